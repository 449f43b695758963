"""The valve node by the wire: what ends a flight, and what may begin one again."""

import pytest

from drivers.valve_bus.protocol import (
    ARM_KEY,
    EVERY_VEHICLE,
    Arm,
    CanFrame,
    FloatAir,
    Heartbeat,
    NodeState,
    Stop,
    StopReason,
    ValveCommand,
    ValveStatus,
    decode,
    encode,
)
from firmware_emulator.laboratory import EmulatedLaboratory

MS = 1_000_000
S = 1_000_000_000
PULSE = (60,) * 4 + (0,) * 4
SETTLE_MS = 2  # a frame takes a quarter of one to arrive


class Bench:
    """One node on the bus and the station's side of it, in whole milliseconds."""

    def __init__(self, floating=True, failures=()):
        vehicle = {"name": "alpha", "floating": floating, "camera": {"source": "none"}}
        self.laboratory = EmulatedLaboratory({"vehicles": [vehicle], "failures": list(failures)}, seed=1)
        self.vehicle = self.laboratory.mock_ups[0].vehicle
        self.now_ms = 0
        self.counter = self.pulse = 0
        self.received = []

    def send(self, *messages):
        for message in messages:
            frame = message if isinstance(message, CanFrame) else encode(message)
            self.laboratory.deliver(self.now_ms * MS, "valve_bus", frame)

    def command(self, on_times_ms=PULSE):
        self.counter = (self.counter + 1) % 16
        self.pulse = (self.pulse + 1) % 16
        self.send(ValveCommand(0, self.counter, self.pulse, on_times_ms))

    def wait(self, until_ms, *, commanding=False, with_each=()):
        """Go on to a moment, with a command every 20 ms or in silence."""
        while self.now_ms < until_ms:
            if commanding and self.now_ms % 20 == 0:
                self.send(*with_each)
                self.command()
            self.now_ms += 1
            for arrival in self.laboratory.advance(self.now_ms * MS):
                if arrival.channel == "valve_bus":
                    self.received.append((arrival.stamp_ns / MS, decode(arrival.data)))

    def settle(self):
        self.wait(self.now_ms + SETTLE_MS)

    def status(self):
        """The next status that the node sends."""
        known = len(self.received)
        self.wait(self.now_ms + 25)
        return next(message for _, message in self.received[known:] if isinstance(message, ValveStatus))

    def first(self, condition):
        """When the first status that fulfils a condition arrived, ms."""
        return next(stamp for stamp, row in self.received if isinstance(row, ValveStatus) and condition(row))


@pytest.fixture
def flying():
    """Armed, afloat and commanded for 200 ms."""
    bench = Bench()
    bench.send(Arm(0, is_armed=True))
    bench.wait(200, commanding=True)
    assert bench.status().is_armed
    return bench


def is_landed(status):
    return not status.is_float_air_on and not status.is_armed and status.open_mask == 0


@pytest.mark.parametrize("data", ["", "01", "0100", "02000000"])
@pytest.mark.parametrize("vehicle", [0, EVERY_VEHICLE])
def test_a_stop_without_grace_lands_at_once(flying, data, vehicle):
    flying.command((127,) * 8)
    flying.settle()
    flying.send(CanFrame(vehicle, bytes.fromhex(data)))
    flying.settle()
    status = flying.status()
    assert is_landed(status)
    assert status.is_stopped
    assert not status.is_stop_pending
    flying.wait(flying.now_ms + 250)
    assert not flying.vehicle.is_floating


def test_a_stop_of_another_vehicle_is_not_obeyed(flying):
    flying.send(Stop(1))
    flying.wait(300, commanding=True)
    assert flying.status().is_float_air_on


def test_while_the_grace_lasts_commands_are_obeyed_and_then_the_node_lands_by_itself(flying):
    flying.wait(400)
    flying.send(Stop(0, StopReason.OPERATOR, 0.5))
    flying.wait(895, commanding=True)
    pending = [m for at, m in flying.received if isinstance(m, ValveStatus) and 405 < at < 895]
    assert all(m.is_stop_pending and m.is_armed and m.is_float_air_on and not m.is_stopped for m in pending)
    assert {m.open_mask for m in pending} == {0x0F}
    flying.wait(1000, commanding=True)
    assert flying.first(lambda m: m.is_stopped) == pytest.approx(900, abs=21)
    assert flying.first(lambda m: m.is_stopped) >= 900
    status = flying.status()
    assert is_landed(status)
    assert status.is_stopped
    assert not status.is_stop_pending


def test_the_grace_ends_to_the_millisecond_though_the_station_is_gone(flying):
    flying.wait(400)
    flying.send(Stop(0, StopReason.OPERATOR, 0.3))
    flying.command((127,) * 8)
    flying.wait(440)
    flying.wait(700)
    assert flying.laboratory.mock_ups[0].vehicle._float_wanted
    flying.wait(702)
    assert not flying.laboratory.mock_ups[0].vehicle._float_wanted


@pytest.mark.parametrize(
    ("second_s", "over_ms"), [(0.1, 600), (0.4, 900), (0.5, 1000), (0.6, 1000), (5.0, 1000), (0.0, 500)]
)
def test_a_later_stop_shortens_the_grace_and_never_lengthens_it(flying, second_s, over_ms):
    flying.wait(400)
    flying.send(Stop(0, StopReason.OPERATOR, 0.6))
    flying.wait(500)
    flying.send(Stop(0, StopReason.OPERATOR, second_s))
    flying.wait(over_ms - 1 if second_s else 500, commanding=False)
    assert flying.vehicle._float_wanted
    flying.wait(over_ms + SETTLE_MS)
    assert not flying.vehicle._float_wanted


def test_a_repeated_frame_that_counts_down_ends_when_the_first_one_said(flying):
    flying.wait(400)
    for step in range(40):
        flying.send(Stop(0, StopReason.OPERATOR, 0.8 - 0.02 * step))
        flying.command()
        flying.wait(400 + 20 * (step + 1))
        if step == 38:
            assert flying.vehicle._float_wanted
    flying.wait(1202)
    assert not flying.vehicle._float_wanted


def test_while_a_stop_is_pending_neither_air_nor_arming_is_obeyed(flying):
    flying.send(Stop(0, StopReason.OPERATOR, 2.0), FloatAir(0, is_on=False), FloatAir(0, is_on=True))
    flying.settle()
    assert not flying.status().is_float_air_on
    flying.send(Arm(0, is_armed=False), Arm(0, is_armed=True))
    flying.settle()
    status = flying.status()
    assert not status.is_armed
    assert status.is_stop_pending


def test_disarming_closes_but_leaves_the_air_and_the_pending_stop(flying):
    flying.command((127,) * 8)
    flying.send(Stop(0, StopReason.OPERATOR, 0.5), Arm(0, is_armed=False))
    flying.settle()
    status = flying.status()
    assert (status.open_mask, status.is_armed, status.is_float_air_on) == (0, False, True)
    assert status.is_stop_pending
    flying.wait(flying.now_ms + 600)
    assert is_landed(flying.status())


@pytest.mark.parametrize("is_armed", [True, False])
def test_after_a_stop_the_air_is_locked_until_an_arm_frame_of_either_kind(flying, is_armed):
    flying.send(Stop(0))
    flying.wait(400, commanding=True)
    flying.send(FloatAir(0, is_on=True), Arm(0, is_armed=is_armed, key=ARM_KEY ^ 1), FloatAir(0, is_on=True))
    flying.wait(500, commanding=True)
    assert not flying.status().is_float_air_on
    flying.wait(540, commanding=True)
    flying.send(Arm(0, is_armed=is_armed), FloatAir(0, is_on=True))
    flying.wait(600, commanding=True)
    status = flying.status()
    assert (status.is_armed, status.is_stopped, status.is_float_air_on) == (is_armed, False, True)


def test_a_grace_after_the_stop_gives_nothing_back(flying):
    flying.send(Stop(0))
    flying.settle()
    flying.send(Stop(0, StopReason.OPERATOR, 1.0))
    flying.settle()
    status = flying.status()
    assert status.is_stopped
    assert not status.is_stop_pending


def test_silence_of_a_second_lands_and_not_before(flying):
    flying.wait(300, commanding=True)  # the last command goes out at 280 ms
    flying.wait(1279)
    assert flying.vehicle._float_wanted
    flying.wait(1282)
    assert not flying.vehicle._float_wanted
    status = flying.status()
    assert is_landed(status)
    assert status.is_landed_by_silence
    assert not status.is_stopped


def test_a_repeated_counter_is_silence(flying):
    last = ValveCommand(0, flying.counter, flying.pulse, PULSE)
    for at_ms in range(220, 1300, 20):
        flying.wait(at_ms)
        flying.send(last)
    status = flying.status()
    assert status.is_landed_by_silence
    assert not status.is_float_air_on


def test_commands_to_a_disarmed_node_hold_the_air():
    bench = Bench()
    bench.wait(3000, commanding=True)
    status = bench.status()
    assert (status.is_float_air_on, status.is_armed, status.is_landed_by_silence) == (True, False, False)


def test_a_node_that_nobody_commands_after_power_up_lands_after_a_second():
    bench = Bench()
    bench.wait(999)
    assert bench.vehicle._float_wanted
    bench.wait(1001)
    assert not bench.vehicle._float_wanted
    assert bench.status().is_landed_by_silence


def test_a_landed_node_that_nobody_commands_was_not_landed_by_silence():
    bench = Bench(floating=False)
    bench.wait(1500)
    assert not bench.status().is_landed_by_silence


def test_in_the_silence_nothing_rises_and_after_it_the_air_does():
    bench = Bench()
    bench.wait(1500)
    bench.send(FloatAir(0, is_on=True), Arm(0, is_armed=True))
    bench.settle()
    status = bench.status()
    assert is_landed(status)
    assert status.is_landed_by_silence
    bench.command()
    bench.send(FloatAir(0, is_on=True))
    bench.settle()
    status = bench.status()
    assert status.is_float_air_on
    assert not status.is_landed_by_silence


def test_a_stop_outlasts_a_silence(flying):
    flying.send(Stop(0, StopReason.OPERATOR, 2.0))
    flying.wait(1500)
    status = flying.status()
    assert (status.is_landed_by_silence, status.is_stop_pending, status.is_stopped) == (True, True, False)
    flying.wait(2300)
    assert flying.status().is_stopped


def test_a_bus_that_falls_silent_lands_the_vehicle():
    bench = Bench(failures=[{"kind": "silent_bus", "vehicle": "alpha", "start_s": 0.2, "end_s": 2.0}])
    bench.send(Arm(0, is_armed=True))
    bench.wait(1150, commanding=True)
    assert bench.vehicle._float_wanted
    bench.wait(1210, commanding=True)
    assert not bench.vehicle._float_wanted
    bench.wait(2100, commanding=True)
    status = bench.status()
    assert is_landed(status)
    assert status.is_landed_by_silence  # told once the node speaks again


def test_the_heartbeat_names_the_state(flying):
    beats = [m for _, m in flying.received if isinstance(m, Heartbeat)]
    assert beats[-1].state is NodeState.ARMED
    flying.send(Stop(0))
    flying.wait(flying.now_ms + 250)
    beats = [m for _, m in flying.received if isinstance(m, Heartbeat)]
    assert beats[-1].state is NodeState.STOPPED


def test_a_pulse_that_a_disarmed_node_noted_does_not_open_after_arming():
    bench = Bench()
    bench.wait(100, commanding=True)
    noted = ValveCommand(0, (bench.counter + 1) % 16, bench.pulse, PULSE)
    bench.send(Arm(0, is_armed=True), noted)
    bench.settle()
    status = bench.status()
    assert (status.is_armed, status.open_mask) == (True, 0)
    assert status.executed_counter == noted.counter
    bench.counter = noted.counter
    bench.command()
    bench.settle()
    assert bench.status().open_mask == 0x0F


@pytest.mark.parametrize("is_armed", [True, False])
def test_only_a_repeated_counter_is_rejected(is_armed):
    bench = Bench()
    bench.send(Arm(0, is_armed=is_armed))
    bench.wait(400, commanding=True)
    assert bench.status().rejected_commands == 0
    for _ in range(3):
        bench.send(ValveCommand(0, bench.counter, bench.pulse, PULSE))
        bench.settle()
    assert bench.status().rejected_commands == 3


@pytest.mark.parametrize("is_armed", [True, False])
def test_the_dead_man_runs_from_power_up_and_ends_with_the_first_command(is_armed):
    bench = Bench()
    bench.send(Arm(0, is_armed=is_armed))
    bench.wait(95)
    assert not any(row.is_dead_man_closed for _, row in bench.received if isinstance(row, ValveStatus))
    bench.wait(125)
    status = bench.status()
    assert (status.is_dead_man_closed, status.is_armed) == (True, is_armed)
    bench.command()
    bench.settle()
    assert not bench.status().is_dead_man_closed


@pytest.mark.parametrize("grace_s", [0.0, 0.3])
def test_a_stop_before_the_first_command_shows(grace_s):
    bench = Bench()
    bench.send(Stop(0, StopReason.OPERATOR, grace_s))
    bench.settle()
    assert bench.status().is_stop_pending is (grace_s > 0)
    bench.wait(400)
    status = bench.status()
    assert is_landed(status)
    assert status.is_stopped


def test_arming_and_disarming_reset_the_landing_and_nothing_else(flying):
    flying.send(ValveCommand(0, flying.counter, flying.pulse, PULSE), Stop(0))
    flying.settle()
    before = flying.status()
    for is_armed in (False, True):
        flying.send(Arm(0, is_armed=is_armed))
        flying.settle()
        status = flying.status()
        assert not status.is_stopped
        assert status.executed_counter == before.executed_counter
        assert status.executed_pulse_id == before.executed_pulse_id
        assert status.rejected_commands == before.rejected_commands == 1


@pytest.mark.parametrize("identifier", [0x040, 0x080, 0x100])
@pytest.mark.parametrize("change", [-1, 1])
def test_a_frame_of_a_wrong_length_is_ignored_and_not_counted(flying, identifier, change):
    good = {0x040: Arm(0, is_armed=False), 0x080: FloatAir(0, is_on=False)}.get(identifier)
    data = encode(good or ValveCommand(0, flying.counter, flying.pulse, PULSE)).data
    longer = (data + b"\x00")[:8] if change > 0 else data[:-1]
    flying.send(CanFrame(identifier, longer))
    flying.settle()
    status = flying.status()
    assert (status.is_armed, status.is_float_air_on) == (True, True)
    assert status.rejected_commands == (1 if len(longer) == len(data) else 0)
