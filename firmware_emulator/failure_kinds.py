"""THE TABLE of kinds of failure: what each may be given, and what is impossible.

A failure is data: its kind, the vehicle it befalls, when, and its parameters (`firmware_emulator.failures`).
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Parameter:
    """What a parameter of a failure may be.

    Attributes:
        default: Where nothing is given; NaN where that means something to the device.
        lowest, highest: Limits, both allowed.
        is_whole: Whether it is an index or a count.
    """

    default: float
    lowest: float
    highest: float
    is_whole: bool = False

    def complaint(self, value: float) -> str | None:
        """What is wrong with a value, or None."""
        if math.isnan(value) and math.isnan(self.default):
            return None
        if not self.lowest <= value <= self.highest:  # NaN too
            return f"must lie in {self.lowest:g}..{self.highest:g}, got {value:g}"
        if self.is_whole and value != int(value):
            return f"must be a whole number, got {value:g}"
        return None


@dataclass(frozen=True, slots=True)
class FailureKind:
    """A row of the table.

    Attributes:
        device: Whom it befalls: `serial`, `imu`, `camera`, `sky` (rendered pictures only),
            `overhead`, `valves`, `body`.
        effect: What happens, in a sentence.
        parameters: By name; a scenario or an order may give these and no others.
        conflict: What is wrong with values that are each possible, in words that follow "failure 'x'"; None
            if nothing is.
    """

    device: str
    effect: str
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    conflict: Callable[[Mapping[str, float]], str | None] | None = None


_VALVE = Parameter(0.0, 0.0, 7.0, is_whole=True)
_STAR = Parameter(0.0, 0.0, 99_999.0, is_whole=True)
_PLACE_M = Parameter(0.0, -100.0, 100.0)


def _share(default: float) -> Parameter:
    return Parameter(default, 0.0, 1.0)


def _count(default: float) -> Parameter:
    return Parameter(default, 0.0, 1000.0, is_whole=True)


def _span(default: float, lowest: float, highest: float) -> Parameter:
    return Parameter(default, lowest, highest)


def _pulse_conflict(given: Mapping[str, float]) -> str | None:
    if given["on_s"] < given["period_s"]:
        return None
    return f"is open for on_s = {given['on_s']:g} s of period_s = {given['period_s']:g} s: always"


FAILURE_KINDS: Mapping[str, FailureKind] = {
    "bit_flips": FailureKind("serial", "Bits of the IMU's line flip.", {"probability_per_bit": _share(1e-4)}),
    "lost_bytes": FailureKind("serial", "Bytes of the IMU's line get lost.",
                              {"probability_per_byte": _share(1e-3)}),
    "half_frames": FailureKind("serial", "Frames break off in the middle.",
                               {"probability_per_frame": _share(0.05)}),
    "stuck_gyro": FailureKind("imu", "The gyro repeats one code.",
                              {"code": Parameter(math.nan, 0.0, 4095.0, is_whole=True)}),
    "dead_tilt": FailureKind("imu", "A tilt chip forces its output out of its window.",
                             {"axis": Parameter(0.0, 0.0, 1.0, is_whole=True)}),
    "shifted_imu": FailureKind("imu", "The nulls of gyro and inclinometers jump.",
                               {"gyro_deg_s": _span(1.0, -100.0, 100.0),
                                "acc_x_mg": _span(5.0, -300.0, 300.0),
                                "acc_y_mg": _span(0.0, -300.0, 300.0)}),
    "silent_imu": FailureKind("imu", "The block sends nothing."),
    "other_imu": FailureKind("imu", "The block reports another serial number when it is asked.",
                             {"serial_number": Parameter(999.0, 0.0, 65535.0, is_whole=True)}),
    "clock_jump": FailureKind("imu", "The block's count of ticks (version 1: of frames) jumps, later back.",
                              {"jump_ms": Parameter(500.0, -32768.0, 32767.0, is_whole=True)}),
    "dead_sky": FailureKind("camera", "The ceiling's lights are off; drawn fixes stop."),
    "frozen_camera": FailureKind("camera", "The camera repeats one picture or pose."),
    "repeating_camera": FailureKind("camera", "The camera sends its last pictures or poses again and again.",
                                    {"pictures": Parameter(5.0, 1.0, 100.0, is_whole=True)}),
    "torn_camera": FailureKind("camera", "The lower half of a picture is that of the one before; drawn fixes "
                               "lie midway."),
    "slow_camera": FailureKind("camera", "Pictures come later than the driver believes, and fewer of them.",
                               {"delay_s": _span(0.5, 0.0, 4.0),
                                "keep_one_in": Parameter(3.0, 1.0, 1000.0, is_whole=True)}),
    "wrong_fixes": FailureKind("camera", "All pictures or poses are as of a place elsewhere, alike.",
                               {"dx_m": _span(0.1, -100.0, 100.0), "dy_m": _PLACE_M,
                                "dheading_deg": _span(0.0, -180.0, 180.0)}),
    "silent_camera": FailureKind("camera", "The camera sends nothing."),
    "false_lights": FailureKind("camera", "Lights that no catalogue knows; drawn fixes are wrong.",
                                {"count": _count(5.0)}),
    "dead_star": FailureKind("sky", "One LED of the ceiling is dark.", {"star": _STAR}),
    "moved_star": FailureKind("sky", "One LED hangs elsewhere than in the list.",
                              {"star": _STAR, "dx_m": Parameter(0.01, -100.0, 100.0), "dy_m": _PLACE_M}),
    "new_star": FailureKind("sky", "A light hangs where the list has none.",
                            {"x_m": _PLACE_M, "y_m": _PLACE_M}),
    "hidden_discs": FailureKind("overhead", "Hands cover discs from the camera over the table.",
                                {"count": _count(3.0)}),
    "stuck_open_valve": FailureKind("valves", "A valve stays open.", {"valve": _VALVE}),
    "stuck_closed_valve": FailureKind("valves", "A valve does not open.", {"valve": _VALVE}),
    "open_coil": FailureKind("valves", "A coil is torn: its valve does not open, and the node reports it.",
                             {"valve": _VALVE}),
    "leaking_valve": FailureKind("valves", "A closed valve leaks.",
                                 {"valve": _VALVE, "fraction": _share(0.1)}),
    "weak_valve": FailureKind("valves", "An open valve gives a share of its thrust.",
                              {"valve": _VALVE, "fraction": _share(0.5)}),
    "pulsing_valve": FailureKind("valves", "A valve opens by itself, again and again.",
                                 {"valve": _VALVE, "period_s": _span(1.0, 0.04, 60.0),
                                  "on_s": _span(0.1, 0.02, 60.0)}, _pulse_conflict),
    "low_tank": FailureKind("valves", "The tank is near empty: below the regulator's pressure thrust fades.",
                            {"tank_bar": _span(3.0, 0.0, 300.0)}),
    "low_battery": FailureKind("valves", "The node reports undervoltage; below 9 V its valves do not open.",
                               {"battery_v": _span(10.5, 0.0, 11.0)}),
    "silent_bus": FailureKind("valves", "The vehicle's CAN node receives and sends nothing."),
    "flooded_bus": FailureKind("valves", "The vehicle's CAN node babbles: foreign frames or its last status.",
                               {"rate_hz": _span(2000.0, 1.0, 20000.0),
                                "own_ids": Parameter(0.0, 0.0, 1.0, is_whole=True)}),
    "pushed": FailureKind("body", "A hand pushes the floating mock-up: table frame, at the centre of mass.",
                          {"force_x_n": _span(1.0, -100.0, 100.0), "force_y_n": _span(0.0, -100.0, 100.0),
                           "torque_nm": _span(0.0, -10.0, 10.0)}),
}  # fmt: skip
"""THE TABLE of the emulator's own kinds of failure; a kind of device may bring more."""


def checked(kind: str, given: Mapping[str, float], kinds: Mapping[str, FailureKind]) -> dict[str, float]:
    """All parameters of a failure, defaults filled in.

    Raises:
        ValueError: There is no such kind or parameter, or a value is impossible; one sentence names it.
    """
    if kind not in kinds:
        raise ValueError(f"no failure of kind {kind!r}; the kinds are {', '.join(kinds)}")
    known = kinds[kind].parameters
    for name, value in given.items():
        if name not in known:
            raise ValueError(
                f"failure {kind!r} has no parameter {name!r}; it has {', '.join(known) or 'none'}"
            )
        complaint = known[name].complaint(value)
        if complaint:
            raise ValueError(f"parameter {name} of failure {kind!r} {complaint}")
    filled = {name: given.get(name, parameter.default) for name, parameter in known.items()}
    conflict = kinds[kind].conflict
    complaint = conflict(filled) if conflict is not None else None
    if complaint:
        raise ValueError(f"failure {kind!r} {complaint}")
    return filled
