"""Docking on a table without noise: the corridor, the way to the gate, contact, abort and retreat."""

import math

import pytest

from groundstation.control.controllers import controllers, make_controller
from groundstation.control.corridor import Corridor, Docking, may_touch
from groundstation.control.dock import Phase
from groundstation.control.state import ControlState, Goal, rotate
from groundstation.control.vehicle import VehicleModel, square_of_eight

VEHICLE = VehicleModel(11.0, 0.25, square_of_eight())
DT_S = 0.1
CORRIDOR = Corridor(
    axis_rad=math.pi / 2,
    half_angle_rad=math.atan(0.25),
    length_m=0.4,
    contact_m=0.4,
    lateral_m=0.01,
    approach_m_s=0.03,
    contact_m_s=0.006,
    slowing_m_s2=0.002,
)
TURNED = ControlState((1.0, 2.0), (0.0, 0.0), math.pi / 2, 0.0)
"""Its port, at +90 deg of the body, looks along the table's -x."""


def moving(x, y, speed_x=0.0, speed_y=0.0):
    return ControlState((x, y), (speed_x, speed_y), 0.0, 0.0)


def test_the_axis_turns_with_the_target():
    seen = CORRIDOR.relative(moving(0.4, 2.1, 0.02, -0.01), TURNED)
    assert seen == pytest.approx((0.6, -0.1, 0.02, 0.01))


def test_who_turns_along_with_the_port_neither_slides_nor_closes_in():
    turning = ControlState((0.0, 0.0), (0.01, 0.02), -math.pi / 2, 0.05)  # the port looks along +x
    along = moving(0.6, 0.0, 0.01, 0.02 + 0.05 * 0.6)
    assert CORRIDOR.relative(along, turning) == pytest.approx((0.6, 0.0, 0.0, 0.0), abs=1e-12)
    place, velocity = CORRIDOR.place(turning, 0.6)
    assert (*place, *velocity) == pytest.approx((0.6, 0.0, 0.01, 0.05))


def test_the_closing_speed_that_is_meant_falls_towards_contact():
    assert CORRIDOR.speed_m_s(0.4) == 0.03
    assert CORRIDOR.speed_m_s(0.1) == pytest.approx(math.sqrt(0.006**2 + 2 * 0.002 * 0.1))
    assert CORRIDOR.speed_m_s(0.0) == CORRIDOR.speed_m_s(-0.01) == 0.006


@pytest.mark.parametrize(
    ("ship", "words"),
    [
        (moving(0.4, 2.0), ""),
        (moving(0.4, 2.059), ""),  # 0.2 m before contact: 10 mm + 0.25 x 200 mm to either side
        (moving(0.4, 2.061), "61 mm beside the axis"),
        (moving(0.4, 1.939), "61 mm beside the axis"),
        (moving(0.19, 2.0), "not before the port"),
        (moving(1.6, 2.0), "not before the port"),
        (moving(0.6, 2.0, 0.015), ""),
        (moving(0.6, 2.0, 0.016), "closes in at 16 mm/s"),
        (moving(0.6, 2.0, -0.1), ""),
    ],
)
def test_the_corridor_has_rules(ship, words):
    found = CORRIDOR.objection(ship, TURNED)
    assert words in found
    assert bool(words) == bool(found)


def test_only_the_named_pair_may_touch_and_only_inside():
    pairs = (Docking("beta", "alpha", CORRIDOR),)
    states = {"alpha": TURNED, "beta": moving(0.5, 2.0), "gamma": moving(0.5, 2.0)}
    assert may_touch("alpha", pairs, states) == {"beta"}
    assert may_touch("beta", pairs, states) == {"alpha"}
    assert may_touch("gamma", pairs, states) == frozenset()
    states["beta"] = moving(0.5, 2.2)
    assert may_touch("alpha", pairs, states) == may_touch("beta", pairs, states) == frozenset()
    del states["beta"]
    assert may_touch("alpha", pairs, states) == frozenset()


def test_the_row_names_who_is_docked_with():
    row = controllers()["dock"]
    config = row.config(target="alpha", axis_deg=90.0)
    assert row.neighbours(config) == ("alpha",)
    assert row.docks_with(config) == ("alpha", config.corridor())
    assert controllers()["station"].docks_with(controllers()["station"].config()) is None


class Approach:
    """A ship and a target that turns on the spot; nothing bounces."""

    def __init__(self, at_m, rate_deg_s=0.0, **parameters):
        given = {"target": "alpha", "axis_deg": 90.0, **parameters}
        self.law = make_controller("dock", given, VEHICLE)
        self.ship = moving(*at_m)
        self.target = ControlState((0.0, 0.0), (0.0, 0.0), 0.0, math.radians(rate_deg_s))
        self.is_seen = True
        self.least_m = math.inf
        self.at_contact = None
        self.phases = [Phase.GATE]

    def step(self):
        others = {"alpha": self.target} if self.is_seen else {}
        wrench = self.law.update(self.ship, Goal((0.0, 0.0), 0.0), DT_S, neighbours=others)
        force = rotate(wrench.force_body_n, self.ship.heading_rad)
        ax, ay = force[0] / VEHICLE.mass_kg, force[1] / VEHICLE.mass_kg
        (x, y), (vx, vy) = self.ship.position_table_m, self.ship.velocity_table_m_s
        turn, rate = wrench.torque_nm / VEHICLE.inertia_kg_m2, self.ship.rate_rad_s
        self.ship = ControlState(
            (x + vx * DT_S + 0.5 * ax * DT_S**2, y + vy * DT_S + 0.5 * ay * DT_S**2),
            (vx + ax * DT_S, vy + ay * DT_S),
            self.ship.heading_rad + rate * DT_S + 0.5 * turn * DT_S**2,
            rate + turn * DT_S,
        )
        heading_rad = self.target.heading_rad + self.target.rate_rad_s * DT_S
        self.target = ControlState((0.0, 0.0), (0.0, 0.0), heading_rad, self.target.rate_rad_s)
        if self.law.phase is not self.phases[-1]:
            self.phases.append(self.law.phase)
        self.least_m = min(self.least_m, math.hypot(*self.ship.position_table_m))
        if self.at_contact is None and self.least_m <= 0.4:
            self.at_contact = self.law._corridor.relative(self.ship, self.target)

    def fly(self, until, longest_s=150.0):
        for _ in range(round(longest_s / DT_S)):
            if self.law.phase is until:
                return
            self.step()
        raise AssertionError(f"{until} was never reached, it {self.law.phase}")


@pytest.mark.parametrize("rate_deg_s", [0.0, 3.0, -3.0])
@pytest.mark.parametrize("at_m", [(0.0, 1.2), (0.9, -0.9), (-0.1, -1.2)])
def test_it_goes_round_to_the_port_and_touches_softly(at_m, rate_deg_s):
    flight = Approach(at_m, rate_deg_s)
    flight.fly(Phase.IN)
    assert flight.least_m > 0.55  # on the way round it kept away
    flight.fly(Phase.DOCKED)
    assert flight.phases == [Phase.GATE, Phase.IN, Phase.DOCKED]
    assert 0.002 < flight.at_contact.closing_m_s < 0.010
    assert abs(flight.at_contact.aside_m) < 0.005
    facing = flight.ship.heading_rad - flight.target.heading_rad - math.radians(270.0)
    assert math.sin(facing) == pytest.approx(0.0, abs=0.02)
    assert math.cos(facing) > 0.9


def test_who_is_pushed_out_of_the_corridor_backs_out_and_tries_again():
    flight = Approach((0.0, 1.2))
    flight.fly(Phase.IN)
    for _ in range(50):
        flight.step()
    x, y = flight.ship.position_table_m
    flight.ship = ControlState((x + 0.2, y), (0.0, 0.0), flight.ship.heading_rad, 0.0)
    flight.step()
    assert flight.law.phase is Phase.BACK
    flight.fly(Phase.GATE)
    assert flight.least_m > 0.5
    flight.fly(Phase.DOCKED)


def test_who_loses_sight_of_the_target_stops_and_backs_out():
    flight = Approach((0.0, 1.2))
    flight.fly(Phase.IN)
    for _ in range(80):
        flight.step()
    flight.is_seen = False
    for _ in range(100):
        flight.step()
    assert math.hypot(*flight.ship.velocity_table_m_s) < 0.002
    assert flight.law.phase is Phase.BACK
    flight.is_seen = True
    flight.fly(Phase.GATE)
    flight.fly(Phase.DOCKED)


def test_who_bounces_off_has_touched_and_presses_no_more():
    flight = Approach((0.0, 1.2))
    flight.fly(Phase.IN)
    while math.hypot(*flight.ship.position_table_m) > 0.402:
        flight.step()
    assert flight.law.phase is Phase.IN
    (x, y), (vx, vy) = flight.ship.position_table_m, flight.ship.velocity_table_m_s
    flight.ship = ControlState((x, y), (-vx / 2, -vy / 2), flight.ship.heading_rad, flight.ship.rate_rad_s)
    flight.step()
    assert flight.law.phase is Phase.DOCKED


def test_after_contact_it_stands_off():
    flight = Approach((0.0, 1.2))
    flight.fly(Phase.DOCKED)
    for _ in range(300):
        flight.step()
    assert math.hypot(*flight.ship.position_table_m) == pytest.approx(0.43, abs=0.003)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"contact_m": 0.2, "length_m": 0.2}, "^length_m: the gate would be 0.36 m from it, give 0.45 m$"),
        ({"contact_m_s": 0.04}, "^contact_m_s: 0.04 is more than approach_m_s = 0.03$"),
    ],
)
def test_a_corridor_that_makes_no_sense_is_refused(parameters, words):
    with pytest.raises(ValueError, match=words):
        make_controller("dock", {"target": "alpha", **parameters}, VEHICLE)
