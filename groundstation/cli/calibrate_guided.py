"""`groundstation calibrate imu --guided`: an operator led through a calibration of a running vehicle."""

from __future__ import annotations

import getpass
import hashlib
import math
import queue
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic, monotonic_ns
from typing import Annotated

import typer
import zenoh

from calibration.imu.guided import GuidedSequence
from calibration.result import CalibrationResult, Provenance
from groundstation.bus.topics import topic_of
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.cli.calibrate_flight import constants, widened
from groundstation.cli.errors import UsageError
from groundstation.cli.fusion_folder import write_atomically
from groundstation.fusion import error_state as es
from groundstation.fusion.offline import OfflineSmoother
from groundstation.messages.cdr import CodecError
from groundstation.messages.definitions import Imu, OverheadFix, StarFix, ValveStatus
from groundstation.nodes.fusion import Fusion
from groundstation.runtime.asking import ask
from groundstation.runtime.errors import GroundStationError
from groundstation.runtime.estimation import fused_floors_of, rig_noise
from groundstation.runtime.rig import load_rig
from groundstation.runtime.running import find_running

HEARD = {topic_of(kind).noun: topic_of(kind) for kind in (Imu, StarFix, OverheadFix, ValveStatus)}
ADVICE_EVERY_S = 1.0
SILENCE_S = 10.0
GO_TO_EVERY_S = 9.0
ROUND_TRIP = ((0.3, 0.0, 0.0), (-0.3, 0.2, math.pi / 2), (0.2, -0.3, math.pi), (0.0, 0.3, -math.pi / 2))
"""Where --drive sends the vehicle in the last step, from where it hovers: m, m, rad."""


def imu(
    rig: Annotated[Path, typer.Argument(help="Rig file of the run that is going on.")],
    out: Annotated[Path, typer.Option(help="TOML to write.")],
    guided: Annotated[bool, typer.Option("--guided", help="Say step by step what to do.")] = False,
    vehicle: Annotated[
        str | None, typer.Option(help="Name of the vehicle; the rig's first if not given.")
    ] = None,
    drive: Annotated[
        bool, typer.Option("--drive", help="Also send the requests: land, float, turn, fly to and fro.")
    ] = False,
) -> None:
    """Calibrate the IMU of a running vehicle: rest, turns, flights; it says when there is enough data.

    Example: groundstation calibrate imu examples/rigs/published.toml --guided --drive --out imu.toml
    """
    if not guided:
        raise UsageError(
            "the IMU is calibrated step by step: give --guided (recordings: see `calibrate joint`)."
        )
    known_rig = load_rig(rig)
    name = vehicle or next(iter(known_rig.vehicles))
    if name not in known_rig.vehicles:
        raise UsageError(f"{rig} has no vehicle {name!r} (it has {', '.join(known_rig.vehicles)}).")
    run = next((found for found in find_running() if name in found.vehicles), None)
    if run is None:
        raise UsageError(
            f"no run with a vehicle {name!r} is going on: start it with `groundstation run {rig}`."
        )
    smoother = OfflineSmoother(widened(rig_noise(known_rig, name)))
    watch = _Watch(Fusion(name, smoother, "filter", fused_floors_of(known_rig, name)), smoother)
    sequence = GuidedSequence()
    try:
        with ZenohBus(run.endpoint) as bus:
            bus.subscribe(f"{name}/*", watch.hear)
            driver = _Driver(run.endpoint, name) if drive else None
            _lead(watch, sequence, driver)
    except zenoh.ZError as error:
        raise GroundStationError(f"the run at {run.endpoint} does not let us in: {error}") from error
    quantities = constants(smoother)
    if not quantities:
        raise GroundStationError(f"{name}: no two star fixes agreed, so nothing was calibrated.")
    digest = hashlib.sha256(rig.read_bytes()).hexdigest()
    result = CalibrationResult(
        f"IMU of {name}, guided",
        Provenance(f"live, rig {rig.name}", digest, datetime.now(UTC)),
        quantities,
        {},
        {f"step_{step}": outcome for step, outcome in sequence.outcomes.items()},
    )
    write_atomically({out: [result.to_toml()]})
    for key, quantity in quantities.items():
        print(f"{key} = {quantity.value:.6g} ± {quantity.std:.2g} {quantity.unit}")


class _Watch:
    """What was heard of the vehicle, and what a filter of our own knows by it."""

    def __init__(self, node: Fusion, smoother: OfflineSmoother) -> None:
        self._node, self._smoother = node, smoother
        self._heard: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()
        self._floats = True
        self._stamp_ns = 0
        self._rest_s = self._turned_rad = self._travelled_m = 0.0
        self._last: tuple[float, float, float] | None = None

    def hear(self, key: str, data: bytes, _attachment: bytes) -> None:
        """Take a sample on Zenoh's thread."""
        noun = key.partition("/")[2]
        if noun in HEARD:
            self._heard.put((noun, data))

    def work(self, timeout_s: float) -> bool:
        """Feed what was heard to the filter; False after silence."""
        try:
            noun, data = self._heard.get(timeout=timeout_s)
        except queue.Empty:
            return False
        while True:
            self._take(noun, data)
            try:
                noun, data = self._heard.get_nowait()
            except queue.Empty:
                return True

    def _take(self, noun: str, data: bytes) -> None:
        try:
            message = HEARD[noun].codec.decode(data)
        except CodecError:
            return
        if isinstance(message, ValveStatus):
            self._floats = message.floating
        if isinstance(message, Imu):
            if not self._floats and self._stamp_ns:
                self._rest_s += min(0.1, (message.stamp_ns - self._stamp_ns) * 1e-9)
            self._stamp_ns = message.stamp_ns
        for _ in self._node.receive(message, monotonic_ns()):
            pass
        state = self._smoother.state()
        if isinstance(message, StarFix) and state is not None:
            pose = (state.x_m, state.y_m, state.heading_rad)
            if self._last is not None:
                self._travelled_m += math.hypot(pose[0] - self._last[0], pose[1] - self._last[1])
                self._turned_rad += abs(pose[2] - self._last[2])
            self._last = pose

    def known(self) -> dict[str, float]:
        """Return the quantities of the goals."""
        amounts = {"rest_s": self._rest_s, "turned_rad": self._turned_rad, "travelled_m": self._travelled_m}
        if self._smoother.state() is None:
            return amounts
        sigma = self._smoother.sigmas().tolist()
        return amounts | {
            "gyro_bias_sigma_rad_s": sigma[es.GYRO_BIAS],
            "gyro_scale_sigma": sigma[es.GYRO_SCALE],
            "lever_sigma_m": max(sigma[es.LEVER_X], sigma[es.LEVER_Y]),
            "slope_sigma_m_s2": max(sigma[es.SLOPE_X], sigma[es.SLOPE_Y]),
            "acc_scale_sigma": max(sigma[es.ACC_MATRIX], sigma[es.ACC_MATRIX + 3]),
        }

    def pose(self) -> tuple[float, float, float]:
        """Return where the vehicle is."""
        return self._last or (0.0, 0.0, 0.0)


class _Driver:
    """Sends the requests that a person would."""

    def __init__(self, endpoint: str, vehicle: str) -> None:
        self._endpoint, self._vehicle = endpoint, vehicle
        self._step, self._sent, self._next_s = "", 0, 0.0
        self._home = (0.0, 0.0, 0.0)

    def act(self, step: str, *, is_rest: bool, pose: tuple[float, float, float], now_s: float) -> None:
        """Do what the step wants, now and then."""
        if step != self._step:
            self._step, self._sent, self._home = step, 0, pose
            for action in ("disarm", "float_off") if is_rest else ("float_on", "release", "arm", "resume"):
                self._ask(action, ())
            self._next_s = now_s + 2.0
        if is_rest or now_s < self._next_s:
            return
        self._next_s = now_s + GO_TO_EVERY_S
        x, y, heading = self._home
        if step == "turn":
            # 120 degrees at a time, three forth and three back
            quarter = self._sent % 6
            heading += math.radians(120.0) * (quarter + 1 if quarter < 3 else 5 - quarter)
        else:
            dx, dy, turn = ROUND_TRIP[self._sent % len(ROUND_TRIP)]
            x, y, heading = x + dx, y + dy, heading + turn
        self._sent += 1
        self._ask("go_to", (x, y, math.remainder(heading, math.tau)))

    def _ask(self, action: str, numbers: tuple[float, ...]) -> None:
        ack = ask(self._endpoint, self._vehicle, action, numbers, getpass.getuser(), 3.0)
        if not ack.accepted and action == "go_to":
            print(f"  {action} was refused: {ack.reason}")


def _lead(watch: _Watch, sequence: GuidedSequence, driver: _Driver | None) -> None:
    """Print instructions until the sequence is through."""
    spoke_s, heard_s = -math.inf, monotonic()
    while True:
        now_s = monotonic()
        if watch.work(0.2):
            heard_s = now_s
        elif now_s - heard_s > SILENCE_S:
            raise GroundStationError(f"nothing was heard of the vehicle for {SILENCE_S:g} s.")
        if now_s - spoke_s < ADVICE_EVERY_S:
            continue
        spoke_s = now_s
        advice = sequence.update(now_s, watch.known())
        if advice.step is None:
            print("Enough data.", flush=True)
            return
        if advice.is_new:
            print(f"{advice.step.name}: {advice.step.instruction}", flush=True)
        else:
            print(f"  {100 * advice.done:3.0f} %   {advice.missing}", flush=True)
        if driver is not None:
            driver.act(advice.step.name, is_rest=advice.step.is_rest, pose=watch.pose(), now_s=now_s)
