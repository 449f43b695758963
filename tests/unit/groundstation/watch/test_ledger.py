"""The latency ledger against ages worked out by hand on a small flight, in whatever order it is reported."""

import math
import random

import pytest

from groundstation.bus.envelope import Cause
from groundstation.parts.control.messages import Wrench
from groundstation.parts.fusion.messages import FusionStatus, VehicleState
from groundstation.parts.imu.messages import Imu, ImuBytes
from groundstation.parts.stars.messages import StarFix, StarSpots
from groundstation.parts.valves.messages import CanOut, ValveCommand, ValveDemand, ValveSelection
from groundstation.watch import ledger as module
from groundstation.watch.ledger import STAGES, Ledger

MS = 1_000_000


class Flight:
    """Publishes messages at times in ms, with their triggers, as the runners do."""

    def __init__(self, message, delivered, cause, vehicle="alpha"):
        self._message, self._delivered, self._cause = message, delivered, cause
        self._vehicle = vehicle
        self._counts = {}
        self.messages = []

    def publish(self, kind, at_ms, trigger=None, vehicle=None, **fields):
        """Publish and return what names the message as a cause; times among the fields are ms as well."""
        fields = {
            k.replace("_ms", "_ns"): round(v * MS) if k.endswith("_ms") else v for k, v in fields.items()
        }
        owner = vehicle or self._vehicle
        number = self._counts[kind, owner] = self._counts.get((kind, owner), 0) + 1
        one = self._delivered(self._message(kind, owner, **fields), number, round(at_ms * MS), trigger)
        self.messages.append(one)
        return self._cause(one)

    def state(self, at_ms, exposure_ms, arrived_ms, **other):
        """Bytes that arrived become a sample and a state."""
        read = self.publish(ImuBytes, arrived_ms + 0.1, stamp_ms=arrived_ms, **other)
        sample = self.publish(Imu, arrived_ms + 0.2, read, **other)
        return self.publish(VehicleState, at_ms, sample, fix_stamp_ms=exposure_ms, **other)

    def picture(self, arrival_ms, spots_ms, fix_ms, exposure_ms, *, fix=True):
        """A picture becomes spots and the tracker's answer."""
        spots = self.publish(StarSpots, spots_ms, Cause("star_image", "alpha", 1), stamp_ms=arrival_ms)
        self.publish(StarFix, fix_ms, spots, stamp_ms=exposure_ms, fix=fix)

    def command(self, wrench_ms, guard_ms, bus_ms, state):
        """A state becomes a frame on the valve bus; every node has seen other messages, too."""
        self.publish(FusionStatus, wrench_ms - 0.5)
        wrench = self.publish(Wrench, wrench_ms, state)
        self.publish(ValveDemand, wrench_ms + 0.5, wrench)
        chosen = self.publish(ValveSelection, wrench_ms + 1, wrench)
        for late_ms in (0, 20):  # the guard sends what is selected again and again
            command = self.publish(ValveCommand, guard_ms + late_ms, chosen)
            self.publish(CanOut, bus_ms + late_ms, command)


@pytest.fixture
def flight(message, delivered, cause):
    """Three exposures, at 1000, 1100 and 1200 ms; the last one's picture gives no fix."""
    flight = Flight(message, delivered, cause)
    before = flight.state(1010, 0, 1009)  # nothing seen yet
    flight.command(1015, 1017, 1018, before)
    flight.picture(1040, 1052, 1063, 1000)
    first = flight.state(1074, 1000, 1072)
    again = flight.state(1084, 1000, 1081.5)
    flight.state(1085, 1070, 1080, vehicle="beta")
    flight.command(1095, 1116, 1131, first)
    flight.command(1145, 1166, 1181, again)  # the same light once more
    flight.picture(1142, 1155, 1170, 1100)
    second = flight.state(1184, 1100, 1180)
    flight.command(1205, 1230, 1250, second)
    flight.picture(1246, 1262, 1281, 1200, fix=False)
    return flight.messages


AGES_MS = {
    "exposure": [0, 0, 0],
    "arrival": [40, 42, 46],
    "spots": [52, 55, 62],
    "fix": [63, 70],
    "state": [74, 84],
    "wrench": [95, 105],
    "guard": [116, 130],
    "bus": [131, 150],
    "bytes_to_state": [1, 2, 2.5, 4],
}
"""Of the flight above, worked out by hand."""


def expected_ms(share):
    """Percentiles between the sorted ages, as a person would interpolate them."""
    found = {}
    for stage, ages in AGES_MS.items():
        place = share * (len(ages) - 1)
        low = min(int(place), len(ages) - 2)
        found[stage] = ages[low] + (place - low) * (ages[low + 1] - ages[low])
    return found


def ages_ms(ledger, vehicle="alpha"):
    latency = ledger.summary(vehicle, 7)
    assert (latency.stamp_ns, latency.vehicle) == (7, vehicle)
    p50, p99 = ([age_s * 1e3 for age_s in ages] for ages in (latency.p50_s, latency.p99_s))
    return dict(zip(latency.stages, p50, strict=True)), dict(zip(latency.stages, p99, strict=True))


def check_flight(ledger):
    p50, p99 = ages_ms(ledger)
    assert p50 == pytest.approx(expected_ms(0.5))
    assert p99 == pytest.approx(expected_ms(0.99))


def test_every_stage_of_a_flight_is_as_worked_out_by_hand(flight):
    ledger = Ledger()
    for one in flight:
        ledger.take_delivered(one)
    check_flight(ledger)
    assert tuple(AGES_MS) == STAGES  # in the order of the chain


def test_the_record_stream_gives_the_same(flight, recorded):
    ledger, decoded = Ledger(), Ledger()
    for one in flight:
        ledger.take(recorded(one))
        decoded.take(recorded(one), one.payload)
    check_flight(ledger)
    check_flight(decoded)


def test_the_order_in_which_processes_report_does_not_matter(flight):
    for seed in range(20):
        shuffled = flight[::-1] if seed == 0 else random.Random(seed).sample(flight, len(flight))
        ledger = Ledger()
        for one in shuffled:
            ledger.take_delivered(one)
        check_flight(ledger)


def test_vehicles_are_kept_apart(flight):
    ledger = Ledger()
    for one in flight:
        ledger.take_delivered(one)
    p50, _ = ages_ms(ledger, "beta")
    assert p50["state"] == pytest.approx(15.0)
    assert p50["bytes_to_state"] == pytest.approx(5.0)
    assert all(math.isnan(p50[stage]) for stage in ("exposure", "fix", "wrench", "guard", "bus"))
    assert all(math.isnan(age) for age in ages_ms(ledger, "gamma")[0].values())


def test_what_no_state_triggered_has_no_age(message, delivered, cause):
    flight = Flight(message, delivered, cause)
    state = flight.state(1010, 1000, 1009)
    request = Cause("request", "operator", 1)
    stopped = flight.publish(ValveCommand, 1020, request)
    flight.publish(CanOut, 1021, stopped)
    flight.publish(CanOut, 1022, request)  # an order to float
    flight.publish(CanOut, 1023)
    brake = flight.publish(ValveSelection, 1024, state)  # no wrench came
    flight.publish(CanOut, 1026, flight.publish(ValveCommand, 1025, brake))
    ledger = Ledger()
    for one in flight.messages:
        ledger.take_delivered(one)
    p50, _ = ages_ms(ledger)
    assert p50["state"] == pytest.approx(10.0)
    assert math.isnan(p50["guard"])
    assert math.isnan(p50["bus"])


def test_light_of_another_camera_counts_only_where_there_is_no_star_tracker(message, delivered, cause):
    flight = Flight(message, delivered, cause)
    flight.command(1015, 1016, 1017, flight.state(1010, 0, 1009))  # no fix yet
    state = flight.state(1030, 1000, 1029)  # an overhead fix
    flight.command(1040, 1041, 1042, state)
    ledger = Ledger()
    for one in flight.messages:
        ledger.take_delivered(one)
    p50, _ = ages_ms(ledger)
    assert (p50["state"], p50["bus"]) == pytest.approx((30.0, 42.0))
    flight.picture(1060, 1070, 1080, 1050)
    flight.state(1090, 1050, 1089)
    for one in flight.messages[-5:]:
        ledger.take_delivered(one)
    p50, _ = ages_ms(ledger)
    assert p50["state"] == pytest.approx(40.0)
    assert math.isnan(p50["bus"])


def test_garbled_bytes_are_passed_over(flight, recorded):
    ledger = Ledger()
    for one in flight:
        whole = recorded(one)
        ledger.take(whole._replace(data=whole.data[:20], sequence=whole.sequence + 1000))
        ledger.take(whole)
    check_flight(ledger)


def test_a_long_flight_takes_bounded_memory(message, delivered, cause, monkeypatch):
    monkeypatch.setattr(module, "_ORIGINS", 64)
    monkeypatch.setattr(module, "_WAITING", 64)
    monkeypatch.setattr(module, "_SAMPLES", 64)
    flight, ledger = Flight(message, delivered, cause), Ledger()
    for number in range(300):
        at_ms = 1000 + 100 * number
        flight.picture(at_ms + 40, at_ms + 41, at_ms + 50, at_ms)
        state = flight.state(at_ms + 60, at_ms, at_ms + 59)
        flight.command(at_ms + 70, at_ms + 71, at_ms + 72, state)
        flight.publish(Wrench, at_ms + 80, Cause("state", "alpha", 10_000 + number))  # its state never comes
    for one in flight.messages:
        ledger.take_delivered(one)
    sizes = [len(ledger._origins_ns), len(ledger._waiting)]
    sizes += [len(known) for known in ledger._vehicles["alpha"].first_ns.values()]
    assert max(sizes) <= 64
    p50, p99 = ages_ms(ledger)
    assert (p50["bus"], p99["bus"]) == pytest.approx((72.0, 72.0))


def test_how_much_is_kept_at_most():
    assert (module._SAMPLES, module._ORIGINS, module._WAITING) == (2000, 16384, 4096)
    kept = {}
    for number in range(4):
        module._keep(kept, number, -number, 4)
    assert kept == {0: 0, 1: -1, 2: -2, 3: -3}
    module._keep(kept, 4, -4, 4)  # the oldest half goes
    assert kept == {2: -2, 3: -3, 4: -4}


def test_the_first_time_counts_and_known_light_takes_no_room(monkeypatch):
    monkeypatch.setattr(module, "_SAMPLES", 2)
    vehicle = module._Vehicle()
    for exposure_ns, at_ns in ((1, 9), (2, 8), (1, 7), (1, 8), (2, 8)):
        vehicle.reach("bus", exposure_ns, at_ns)
    assert vehicle.first_ns["bus"] == {1: 7, 2: 8}
