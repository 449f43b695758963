"""Edge, brake law and dead reckoning to the last sign and limit; numbers by hand."""

import math

import pytest
from pydantic import ValidationError

from groundstation.control.brake import BrakeConfig, brake_wrench, dead_reckoned
from groundstation.control.edge import EdgeVerdict, edge_outlook
from groundstation.control.keep_in import rectangle
from groundstation.control.state import BodyWrench, ControlState
from groundstation.control.vehicle import VehicleModel, square_of_eight
from groundstation.control.wrench_envelope import WrenchEnvelope

VEHICLE = VehicleModel(10.0, 0.25, square_of_eight())
ENVELOPE = WrenchEnvelope(VEHICLE)
TABLE = rectangle((2.0, 1.0))
CONFIG = BrakeConfig(damping_per_s=2.0, rest_speed_m_s=0.002, rest_rate_deg_s=1.0, torque_share=0.25)


def moving(x=0.0, y=0.0, speed_x=0.0, speed_y=0.0, heading_rad=0.0, rate_rad_s=0.0):
    return ControlState((x, y), (speed_x, speed_y), heading_rad, rate_rad_s)


class TestEdge:
    def test_a_slanting_way_is_braked_along_the_velocity(self):
        # 3-4-5: 0.25 m/s; stopping takes 0.1 + 0.25 / (2 * 0.25) = 0.6 s of each component
        outlook = edge_outlook(moving(0.0, 0.0, 0.15, 0.20), TABLE, 0.25, reaction_s=0.1)
        assert outlook.room_m == pytest.approx(0.5 - 0.20 * 0.6)
        assert outlook.stopping_distance_m == pytest.approx(0.25 * 0.6)
        assert outlook.time_to_edge_s == pytest.approx(0.5 / 0.20)

    @pytest.mark.parametrize(
        ("speed", "distance_m"),
        [((0.25, 0.0), 1.1), ((-0.25, 0.0), 0.9), ((0.0, 0.25), 0.55), ((0.0, -0.25), 0.45)],
    )
    def test_each_edge_is_met(self, speed, distance_m):
        outlook = edge_outlook(moving(-0.1, -0.05, *speed), TABLE, 0.25, reaction_s=0.0)
        assert outlook.room_m == pytest.approx(distance_m - 0.125)
        assert outlook.time_to_edge_s == pytest.approx(distance_m / 0.25)

    def test_at_rest_no_edge_is_ever_met(self):
        outlook = edge_outlook(moving(0.99), TABLE, 0.03, reaction_s=0.1)
        assert (outlook.room_m, outlook.time_to_edge_s) == (math.inf, math.inf)
        assert (outlook.verdict, outlook.stopping_distance_m) == (EdgeVerdict.CLEAR, 0.0)

    @pytest.mark.parametrize(
        ("x", "verdict"), [(0.6875, "CLEAR"), (0.6876, "BRAKE"), (0.75, "BRAKE"), (0.7501, "TOO_LATE")]
    )
    def test_limits_are_exact(self, x, verdict):
        # 0.25 m/s, 0.125 m/s2: 0.25 m of way; a reserve of 1/16 m
        outlook = edge_outlook(moving(x, 0.0, 0.25), TABLE, 0.125, reaction_s=0.0, reserve_m=0.0625)
        assert outlook.verdict is EdgeVerdict[verdict]

    @pytest.mark.parametrize(("x", "verdict"), [(0.699, "CLEAR"), (0.701, "BRAKE"), (0.704, "BRAKE")])
    def test_the_reserve_is_five_centimetres_unless_stated(self, x, verdict):
        outlook = edge_outlook(moving(x, 0.0, 0.25), TABLE, 0.125, reaction_s=0.0)
        assert outlook.verdict is EdgeVerdict[verdict]

    def test_outside_and_going_on_it_crosses_now(self):
        outlook = edge_outlook(moving(1.1, 0.0, 0.25), TABLE, 0.125, reaction_s=0.0)
        assert outlook.time_to_edge_s == 0.0
        assert outlook.room_m == pytest.approx(-0.1 - 0.25)
        assert outlook.verdict is EdgeVerdict.TOO_LATE

    def test_without_authority_every_motion_is_too_late(self):
        for braking_m_s2 in (0.0, -1.0):
            outlook = edge_outlook(moving(0.0, 0.0, 0.01), TABLE, braking_m_s2, reaction_s=0.0)
            assert outlook.verdict is EdgeVerdict.TOO_LATE
            assert outlook.stopping_distance_m == pytest.approx(1e-4 / 2e-6)


class TestBrake:
    def test_near_rest_the_force_is_proportional_to_what_is_above_rest(self):
        # 10 kg * 2 /s * (0.005 - 0.002) m/s
        wrench = brake_wrench(moving(speed_x=0.003, speed_y=0.004), CONFIG, VEHICLE, ENVELOPE)
        assert wrench.force_body_n == pytest.approx((-0.06 * 0.6, -0.06 * 0.8))
        assert wrench.torque_nm == 0.0

    def test_the_force_is_against_the_velocity_in_body_axes(self):
        wrench = brake_wrench(moving(speed_x=0.005, heading_rad=math.pi / 2), CONFIG, VEHICLE, ENVELOPE)
        assert wrench.force_body_n == pytest.approx((0.0, 0.06))

    def test_the_torque_is_against_the_turn(self):
        rate = math.radians(1.5)
        # 0.25 kg m2 * 2 /s * 0.5 deg/s
        expected = 0.5 * math.radians(0.5)
        slow = brake_wrench(moving(rate_rad_s=rate), CONFIG, VEHICLE, ENVELOPE)
        assert slow.torque_nm == pytest.approx(-expected)
        assert slow.force_body_n == (0.0, 0.0)
        other = brake_wrench(moving(rate_rad_s=-rate), CONFIG, VEHICLE, ENVELOPE)
        assert other.torque_nm == pytest.approx(expected)

    def test_a_fast_turn_leaves_the_valves_to_the_force(self):
        wrench = brake_wrench(moving(rate_rad_s=1.0), CONFIG, VEHICLE, ENVELOPE)
        assert wrench.torque_nm == pytest.approx(-0.25 * ENVELOPE.max_torque_nm)

    @pytest.mark.parametrize("speed_m_s", [0.0, 0.002])
    def test_rest_costs_nothing(self, speed_m_s):
        wrench = brake_wrench(
            moving(speed_x=speed_m_s, rate_rad_s=math.radians(1.0)), CONFIG, VEHICLE, ENVELOPE
        )
        assert math.hypot(*wrench.force_body_n) == pytest.approx(0.0, abs=1e-12)
        assert wrench.torque_nm == pytest.approx(0.0, abs=1e-12)

    @pytest.mark.parametrize("speed_m_s", [0.5, 2.0, 1e3])
    @pytest.mark.parametrize("heading_rad", [0.0, 0.3, math.pi / 4, 2.0])
    def test_a_high_speed_is_braked_with_all_there_is_against_it(self, speed_m_s, heading_rad):
        wrench = brake_wrench(moving(speed_x=speed_m_s, heading_rad=heading_rad), CONFIG, VEHICLE, ENVELOPE)
        force = wrench.force_body_n
        assert math.atan2(force[1], force[0]) == pytest.approx(
            math.remainder(math.pi - heading_rad, 2 * math.pi), abs=1e-9
        )
        whole = ENVELOPE.saturate(
            BodyWrench((-1e3 * math.cos(heading_rad), 1e3 * math.sin(heading_rad)), wrench.torque_nm)
        )
        assert math.hypot(*force) == pytest.approx(math.hypot(*whole.force_body_n))

    def test_a_strong_direction_is_used_up_to_twice_the_weakest(self):
        uneven = VehicleModel(10.0, 0.25, (*square_of_eight(0.15, 1.0)[:4], *square_of_eight()[4:]))
        envelope = WrenchEnvelope(uneven)
        wrench = brake_wrench(moving(speed_x=2.0), CONFIG, uneven, envelope)
        assert wrench.force_body_n == pytest.approx((-2.0 * envelope.max_force_n, 0.0))

    def test_headings_of_many_turns_brake_alike(self):
        one = brake_wrench(moving(speed_x=0.005, heading_rad=1.0), CONFIG, VEHICLE, ENVELOPE)
        many = brake_wrench(moving(speed_x=0.005, heading_rad=1.0 + 20 * math.pi), CONFIG, VEHICLE, ENVELOPE)
        assert many.force_body_n == pytest.approx(one.force_body_n)

    def test_usual_values(self):
        usual = BrakeConfig()
        assert (usual.damping_per_s, usual.rest_speed_m_s, usual.rest_rate_deg_s, usual.torque_share) == (
            2.0, 0.002, 1.0, 0.25,
        )  # fmt: skip

    @pytest.mark.parametrize(
        ("key", "good", "bad"),
        [
            ("damping_per_s", 0.01, 0.0),
            ("rest_speed_m_s", 0.0, -0.01),
            ("rest_rate_deg_s", 0.0, -0.01),
            ("torque_share", 0.01, 0.0),
            ("torque_share", 1.0, 1.01),
        ],
    )
    def test_what_makes_no_sense_is_refused(self, key, good, bad):
        assert getattr(BrakeConfig(**{key: good}), key) == good
        with pytest.raises(ValidationError, match=key):
            BrakeConfig(**{key: bad})

    def test_unknown_keys_are_refused_and_values_stay(self):
        with pytest.raises(ValidationError, match="gain"):
            BrakeConfig(gain=1.0)
        with pytest.raises(ValidationError, match="frozen"):
            CONFIG.damping_per_s = 3.0


class TestDeadReckoning:
    def test_without_a_wrench_it_coasts(self):
        start = moving(0.1, 0.2, 0.03, -0.04, 0.5, 0.2)
        end = dead_reckoned(start, BodyWrench((0.0, 0.0), 0.0), 3.0, VEHICLE)
        assert end.position_table_m == pytest.approx((0.19, 0.08))
        assert end.velocity_table_m_s == (0.03, -0.04)
        assert (end.heading_rad, end.rate_rad_s) == (pytest.approx(1.1), 0.2)

    def test_a_force_and_a_torque_act_along_the_middle_heading(self):
        # heading 0.5 + 0.5 * 0.2 * 3 = 0.8 rad; 2 N on 10 kg: 0.2 m/s2 for 3 s
        end = dead_reckoned(moving(1.0, 2.0, 0.1, 0.3, 0.5, 0.2), BodyWrench((2.0, 0.0), 0.025), 3.0, VEHICLE)
        ax, ay = 0.2 * math.cos(0.8), 0.2 * math.sin(0.8)
        assert end.velocity_table_m_s == pytest.approx((0.1 + 3.0 * ax, 0.3 + 3.0 * ay))
        assert end.position_table_m == pytest.approx((1.0 + 0.3 + 4.5 * ax, 2.0 + 0.9 + 4.5 * ay))
        assert end.rate_rad_s == pytest.approx(0.2 + 0.1 * 3.0)
        assert end.heading_rad == pytest.approx(0.5 + 0.6 + 0.5 * 0.1 * 9.0)
