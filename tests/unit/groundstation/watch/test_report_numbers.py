"""Numbers and figures of a report, from a flight of which they are known."""

import math

import numpy as np
import pytest

from groundstation.parts.control.messages import ControlStatus
from groundstation.parts.fusion.messages import FixAccount, VehicleState
from groundstation.parts.imu.messages import Imu
from groundstation.parts.operation.messages import Diagnostics, Latency
from groundstation.parts.overhead.messages import FixComparison
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.supervision.messages import Supervision
from groundstation.parts.valves.messages import ValveCommand
from groundstation.watch.ledger import STAGES
from groundstation.watch.page.latency import reached_stages
from groundstation.watch.summary import summarise, wanted, wanted_columns

START_NS = 5_000_000_000
FLYING_S = 2.0
KEYS = [
    "flying_since_s",
    "settled_for_s",
    "station_position_rms_mm",
    "station_position_max_mm",
    "station_heading_rms_deg",
    "estimate_position_rms_mm",
    "estimate_heading_rms_deg",
    "imu_frames",
    "imu_frames_lost",
    "fixes",
    "fix_innovation_position_rms_mm",
    "fix_innovation_heading_rms_deg",
    "fix_nis_mean",
    "latency_p50_ms",
    "latency_p99_ms",
]


def flight(message, *, nis):
    """30 s: 5 mm off the goal from 22 s on, the estimate 2 mm and 1 deg off, and much worse before."""
    turn = math.radians(1.0)

    def at(kind, t_s, **fields):
        return message(kind, "alpha", START_NS + round(t_s * 1e9), **fields)

    yield at(Supervision, FLYING_S, mode="flying")
    yield at(Diagnostics, 0.0, node="alpha/imu")
    goal = {"goal_position_table_m": (1.0, 2.0), "goal_heading_rad": math.pi - 0.01}
    yield at(ControlStatus, 0.0, **goal)
    for number in range(301):
        t_s, heading_rad = 0.1 * number, 0.01 - math.pi  # across the turn from pi to -pi
        off_m = 0.005 if t_s >= FLYING_S + 20.0 else 0.5
        yield at(ReferenceState, t_s, position_table_m=(1.0 + off_m, 2.0), heading_rad=heading_rad)
        there = (1.0 + off_m, 2.002 if off_m < 0.1 else 2.3)
        yield at(VehicleState, t_s, position_table_m=there, heading_rad=heading_rad + turn)
        yield at(Imu, t_s, frames_lost=number // 100)
        yield at(ValveCommand, t_s, on_time_ms=bytes([number % 128] * 8))
    for used, reason in ((True, ""), (True, ""), (False, "outside the gate")):
        innovation = (0.003, 0.004, math.radians(0.5))
        yield at(FixAccount, 25.0, used=used, reason=reason, innovation=innovation, nis=nis)
    ages_s = tuple(0.01 * index for index in range(len(STAGES)))
    yield at(Latency, 29.0, stages=STAGES, p50_s=(math.nan,) * len(STAGES), p99_s=ages_s)
    yield at(Latency, 30.0, stages=STAGES, p50_s=ages_s, p99_s=tuple(2 * age for age in ages_s))


@pytest.fixture
def report(tables, message, delivered):
    def make(*more, nis=3.0):
        payloads = (*flight(message, nis=nis), *more)
        return summarise(tables, map(delivered, payloads), START_NS)

    return make


def test_numbers_are_those_of_the_flight_under_the_names_of_before(report):
    numbers = report()["alpha"].numbers
    assert sorted(numbers) == sorted(KEYS)
    assert numbers["flying_since_s"] == FLYING_S
    assert numbers["settled_for_s"] == pytest.approx(8.0)
    assert numbers["station_position_rms_mm"] == pytest.approx(5.0)
    assert numbers["station_position_max_mm"] == pytest.approx(5.0)
    assert numbers["station_heading_rms_deg"] == pytest.approx(math.degrees(0.02))
    assert numbers["estimate_position_rms_mm"] == pytest.approx(2.0)
    assert numbers["estimate_heading_rms_deg"] == pytest.approx(1.0)
    assert (numbers["imu_frames"], numbers["imu_frames_lost"]) == (301, 3)
    assert numbers["fixes"] == {"used": 2, "outside the gate": 1}
    assert numbers["fix_innovation_position_rms_mm"] == pytest.approx(5.0)
    assert numbers["fix_innovation_heading_rms_deg"] == pytest.approx(0.5)
    assert numbers["fix_nis_mean"] == pytest.approx(3.0)
    assert list(numbers["latency_p50_ms"]) == list(STAGES)
    assert numbers["latency_p50_ms"]["state"] == pytest.approx(40.0)
    assert numbers["latency_p99_ms"]["state"] == pytest.approx(80.0)


def test_a_vehicle_that_never_flew_has_no_numbers_and_gives_no_warning(tables, message, delivered):
    state = message(VehicleState, "alpha", START_NS)
    numbers = summarise(tables, [delivered(state)], START_NS)["alpha"].numbers
    missing = [key for key, value in numbers.items() if isinstance(value, float) and math.isnan(value)]
    assert len(missing) == 9
    assert (numbers["settled_for_s"], numbers["imu_frames"], numbers["fixes"]) == (0.0, 0, {})


def test_vehicles_without_a_state_are_left_out(report, message):
    found = report(message(Imu, "beta"), message(Diagnostics, ""))
    assert list(found) == ["alpha"]


def test_two_sources_add_their_comparison(report, message):
    pair = message(FixComparison, verdict="agree", nis=3.0)
    assert report(pair)["alpha"].numbers["star_against_overhead"]["pairs"] == 1


def test_only_what_the_report_needs_is_read(tables):
    kinds = wanted(tables)
    assert len(kinds) == len(set(kinds))
    assert {FixComparison, Latency} <= set(kinds)
    columns = wanted_columns(tables)
    assert {Imu, ValveCommand, VehicleState} <= set(columns)
    assert not set(kinds) & set(columns), "what comes as columns is not decoded once more"
    assert Diagnostics not in {*kinds, *columns}


def test_the_track_is_made_of_its_messages(report):
    track = report()["alpha"].track
    shapes = (track.truth.shape, track.state.shape, track.goal.shape, track.on_times.shape)
    assert shapes == ((301, 4), (301, 7), (1, 4), (301, 9))
    assert track.account_reasons == ["", "", "outside the gate"]
    assert np.ptp(track.truth[:, 3]) == 0.0
    assert track.latency is not None
    assert track.latency.p50_s[1] == 0.01  # the newest


def test_a_stage_that_no_light_reached_is_left_out_of_the_figure_and_not_drawn_as_0():
    nan = math.nan
    drawn = Latency(0, "alpha", ("exposure", "spots", "fix"), (0.0, nan, 0.6), (0.0, nan, 0.7))
    seen = Latency(0, "beta", ("exposure", "spots", "fix"), (0.0, 0.02, 0.03), (0.0, 0.03, 0.05))
    assert reached_stages([drawn]) == ["exposure", "fix"]
    assert reached_stages([drawn, seen]) == ["exposure", "spots", "fix"]
    assert reached_stages([]) == []
