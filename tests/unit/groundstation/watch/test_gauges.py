"""What the parts show of a vehicle: rows, the line of the log, events."""

import math

import pytest

from groundstation.declarations.request import Ack
from groundstation.declarations.view import Level
from groundstation.parts.control.messages import ControlStatus
from groundstation.parts.fusion.messages import FixAccount, FusionStatus, VehicleState
from groundstation.parts.imu.messages import Imu
from groundstation.parts.operation.messages import Diagnostics
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.stars.messages import SkyChange, StarFix
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.parts.valves.messages import Outlook, ValveCommand, ValveSelection, ValveStatus
from groundstation.watch.monitor import Monitor

SECOND_NS = 1_000_000_000


class Watched:
    """A monitor of one vehicle that is given payloads at seconds."""

    def __init__(self, tables, message, delivered):
        self.monitor = Monitor(tables, ("alpha",))
        self._message, self._delivered = message, delivered
        self.now_ns = 0

    def give(self, kind, second, vehicle="alpha", **fields):
        self.now_ns = round(second * SECOND_NS)
        payload = self._message(kind, vehicle, self.now_ns, **fields)
        self.monitor.take_delivered(self._delivered(payload), self.now_ns)

    def cells(self):
        vehicle = self.monitor.vehicles["alpha"]
        return dict(zip(vehicle.labels(), vehicle.rows(self.now_ns), strict=True))

    def row(self, label):
        return self.cells()[label].text

    def line(self):
        return self.monitor.vehicles["alpha"].line(self.now_ns)

    def look(self, second):
        self.monitor.take_lines()
        self.now_ns = round(second * SECOND_NS)
        self.monitor.look(self.now_ns)
        return self.monitor.take_lines()


@pytest.fixture
def watched(tables, message, delivered):
    return Watched(tables, message, delivered)


def fix(watched, second, reason=""):
    watched.give(StarFix, second, fix=not reason, reason=reason)


def test_the_rows_stand_in_their_order(watched):
    assert watched.monitor.vehicles["alpha"].labels() == (
        "mode",
        "faults",
        "valves",
        "commanded by",
        "stops within",
        "tank",
        "position, heading",
        "off its goal",
        "  rms of 30 s, by truth",
        "estimate, rms by truth",
        "IMU",
        "star fixes",
        "  innovation, NIS",
        "  refused",
        "  not used",
        "thrust, learned",
    )
    assert {cell.text for cell in watched.cells().values()} == {"-"}


def test_the_present_reason_is_named_and_each_kind_is_counted(watched):
    reasons = ["", "too few stars: 3 spots", "no light spots: none", "too few stars: 2 spots"]
    for second, reason in enumerate(reasons, start=1):
        fix(watched, second, reason)
    assert watched.row("  refused") == "now: too few stars; 2 x too few stars, 1 x no light spots"
    assert watched.line().endswith("no fix: too few stars (2 x)")


def test_with_a_fix_again_only_the_counts_remain(watched):
    fix(watched, 1, "too blurred: 9 spots")
    fix(watched, 2)
    assert watched.row("  refused") == "1 x too blurred"
    assert "no fix" not in watched.line()


@pytest.mark.parametrize(
    ("change", "star", "words"),
    [
        ("died", "7", "alpha: star 7 died at (1.000, 2.000) m, no longer used"),
        ("returned", "7", "alpha: star 7 returned at (1.000, 2.000) m, used again"),
        ("appeared", "", "a light that is no star appeared at (1.000, 2.000) m, proposed"),
    ],
)
def test_changes_of_the_sky_are_reported_with_what_follows(watched, change, star, words):
    watched.give(SkyChange, 1, change=change, star=star, x_m=1.0, y_m=2.0)
    (line,) = watched.monitor.take_lines()
    assert words in line


def test_what_is_not_known_yet_is_a_dash(watched):
    line = watched.line()
    assert "nan" not in line
    assert "inf" not in line
    assert "age    - s" in line


def test_the_line_of_a_log_has_fixed_columns(watched):
    before = watched.line()
    watched.give(Supervision, 1, mode="flying", cause="every check passed")
    watched.give(ValveCommand, 1, gate="open")
    watched.give(VehicleState, 1, position_table_m=(1.25, -0.5), heading_rad=math.pi / 2, status="flying")
    watched.give(ControlStatus, 1, goal_position_table_m=(1.25, -0.496), goal_heading_rad=math.pi / 2)
    watched.give(ReferenceState, 1, position_table_m=(1.251, -0.5), heading_rad=math.pi / 2)
    watched.give(Imu, 1, frames_lost=2, valid=True)
    watched.give(FusionStatus, 1, fixes_used=5, fixes_refused=1, fix_age_s=0.125)
    fix(watched, 1)
    assert watched.line() == (
        "flying     no faults  armed       1250.0   -500.0 mm   90.00 deg  off    4.0 mm   0.00 deg  "
        "est  1.00 mm 0.000 deg  imu   0/s lost 2  fix  0.3/s age 0.12 s used 5 refused 1"
    )
    first = "position, heading"
    assert before.index(" mm ") == watched.line().index(" mm "), first


def test_levels_say_what_is_bad(watched):
    watched.give(Supervision, 1, mode="stopped", cause="stopped", author="operator")
    watched.give(ValveCommand, 1, gate="stopped")
    watched.give(ValveStatus, 1, open_mask=0b101, dead_man=True, pressure_pa=3e7)
    watched.give(ValveSelection, 1, source="brake", reason="no command")
    watched.give(VehicleState, 1, status="lost")
    watched.give(Imu, 1, reason="frozen", frames_lost=3)
    cells = watched.cells()
    assert cells["mode"].pieces == (("stopped (stopped, by operator)", Level.BAD),)
    assert cells["valves"].pieces == (
        ("stopped ", Level.WARNING),
        ("●·●·····", Level.PLAIN),
        (" dead man", Level.BAD),
    )
    assert cells["commanded by"].pieces == (("brake: no command", Level.WARNING),)
    assert cells["position, heading"].pieces[-1] == ("  LOST", Level.BAD)
    assert cells["tank"].text == "300 bar, float air off"
    assert cells["IMU"].pieces[1:] == (("  3 lost", Level.WARNING), ("  frozen", Level.BAD))


def test_how_long_the_gas_lasts_is_shown_while_it_floats(watched):
    for second in range(301):  # 0.1 bar a second afloat and steering evenly, from 100 bar on; empty at 30
        watched.give(ValveStatus, second, floating=True, open_mask=0b11, pressure_pa=1e7 - 1e4 * second)
        watched.look(second)
    assert watched.cells()["tank"].text == "70 bar, 7 min left, ± 1"
    watched.give(ValveStatus, 302, floating=False, pressure_pa=7e6)
    assert watched.cells()["tank"].text == "70 bar, float air off"


def test_where_it_can_stop_is_shown_while_it_flies(watched):
    watched.give(
        Outlook, 1, stopping_distance_m=0.123, time_to_edge_s=14.2, nearest="beta", nearest_room_m=0.4
    )
    assert watched.cells()["stops within"].text == "-"
    watched.give(ValveCommand, 1, gate="open")
    assert watched.cells()["stops within"].pieces == (("123 mm, edge in 14 s, beta 400 mm off", Level.PLAIN),)
    watched.give(Outlook, 2, stopping_distance_m=0.05, time_to_edge_s=math.inf, limited_by="edge, beta")
    assert watched.cells()["stops within"].pieces == (("50 mm, held back for: edge, beta", Level.WARNING),)


def test_fixes_are_counted_by_what_became_of_them(watched):
    for second, nis in enumerate((2.0, 4.0), start=1):
        watched.give(FixAccount, second, used=True, nis=nis, innovation=(0.003, 0.004, 0.0))
    for second in (3, 4):
        watched.give(FixAccount, second, reason="outside the gate", nis=40.0, innovation=(0.03, 0.04, 0.0))
    cells = watched.cells()
    assert cells["  not used"].text == "2 x outside the gate"
    assert cells["  innovation, NIS"].text == "   50.00 mm    0.000 deg  40.0, mean 3.0 of 3"
    assert cells["  innovation, NIS"].pieces[0][1] is Level.BAD


def test_station_keeping_is_measured_to_the_setpoint_while_flying(watched):
    watched.give(ControlStatus, 1, goal_position_table_m=(1.0, 2.0), goal_heading_rad=3.1)
    watched.give(ReferenceState, 1, position_table_m=(9.0, 9.0))  # not flying yet
    watched.give(Supervision, 2, mode="flying")
    watched.give(ReferenceState, 3, position_table_m=(1.003, 2.004), heading_rad=-3.1)
    assert watched.row("  rms of 30 s, by truth") == "    5.00 mm    4.766 deg"
    watched.give(ReferenceState, 40, position_table_m=(1.001, 2.0), heading_rad=3.1)  # the first is too old
    assert watched.row("  rms of 30 s, by truth") == "    1.00 mm    0.000 deg"


def test_the_estimate_is_carried_to_the_moment_of_the_truth(watched):
    watched.give(VehicleState, 1, velocity_table_m_s=(0.1, 0.0), rate_rad_s=0.0, status="flying")
    watched.give(ReferenceState, 1.01, position_table_m=(0.001, 0.002))
    assert watched.row("estimate, rms by truth") == "    2.00 mm    0.000 deg"


def test_modes_and_refused_requests_are_events(watched):
    for _ in range(2):
        watched.give(Supervision, 1, mode="resting", cause="flight is wanted", author="ann")
    watched.give(Ack, 2, action="arm", accepted=True)
    watched.give(Ack, 3, action="go_to", accepted=False, reason="off the table")
    assert watched.monitor.take_lines() == [
        "alpha: resting (flight is wanted, by ann)",
        "alpha: go_to refused: off the table",
    ]


def test_faults_are_shown_until_they_clear_and_are_events(watched):
    row = {"ids": ("tank_low",), "whats": ("The tank is nearly empty.",), "details": ("20 bar",)}
    more = {"since_ns": (0.0,), "responses": ("brakes, then lands",), "advices": ("Fill it.",)}
    watched.give(Faults, 1)
    assert watched.row("faults") == "none"
    watched.give(Faults, 2, **row, **more, gone_ns=(0.0,))
    assert watched.row("faults") == "tank_low (2 s, brakes, then lands)"
    watched.give(Faults, 3, **row, **more, gone_ns=(2e9,))
    assert watched.row("faults") == "tank_low (gone, release clears it)"
    watched.give(Faults, 4)
    assert watched.monitor.take_lines() == [
        "alpha: FAULT tank_low: The tank is nearly empty. (20 bar) It brakes, then lands. Fill it.",
        "alpha: fault tank_low is gone; release clears it",
    ]


def test_a_silent_line_and_one_of_noise_are_reported_until_samples_come(watched):
    watched.give(Diagnostics, 1, node="alpha/imu", level=0, summary="alpha/imu: open")
    assert watched.look(3.9) == []
    (line,) = watched.look(4.1)
    assert line == "alpha/imu: open, but no byte comes: is the block switched on? Listening on"
    assert watched.look(5) == []
    watched.give(Imu, 6)
    assert watched.look(6.1) == ["alpha/imu: samples come"]
    for second, count in ((7, "10"), (8, "20")):
        watched.give(Diagnostics, second, node="alpha/imu_reader", keys=("bytes_seen",), values=(count,))
    (line,) = watched.look(10)
    assert line.startswith("alpha/imu: noise and no frame")
    watched.give(Diagnostics, 11, node="alpha/imu", level=2, summary="alpha/imu: gone")
    assert watched.look(11.1) == []  # its port has reported that


def test_a_silent_valve_node_is_reported_until_it_reports(watched):
    watched.give(Diagnostics, 1, "", node="valve_bus", level=0, summary="valve_bus: open")
    (line,) = watched.look(5)
    assert line.startswith("alpha: nothing comes from its valve node")
    assert watched.look(6) == []
    watched.give(ValveStatus, 7)
    assert watched.look(7.1) == ["alpha: its valve node reports"]
