"""Thrust and dead time of hidden valves, learned while flying to and fro, within three of their sigmas."""

import json
import math

import numpy as np

from groundstation.declarations.request import Request
from groundstation.declarations.view import Newest
from groundstation.parts.supervision.learned import LearnedFigure, LearnedGauge
from groundstation.parts.supervision.messages import ValveShares, ValvesLearned

LEARNS = "\n[mock_ups.standard]\nlearns_valves = true\n"
THRUST_N = (0.20, 0.23, 0.22, 0.185, 0.24, 0.21, 0.225, 0.25)
MASS_KG, RIG_MASS_KG, RIG_THRUST_N = 11.3, 11.0, 0.22
OPEN_S, CLOSE_S = 0.0068, 0.0046
PLACES = [
    ((x, y), push)
    for push, sites in (
        ((1.0, 0.0), ((-0.15, 0.15), (-0.15, -0.15))),
        ((-1.0, 0.0), ((0.15, 0.15), (0.15, -0.15))),
        ((0.0, 1.0), ((0.15, -0.15), (-0.15, -0.15))),
        ((0.0, -1.0), ((0.15, 0.15), (-0.15, 0.15))),
    )
    for x, y in sites
]


def hidden(stuck=""):
    """Changes of the laboratory that the rig does not state."""
    thrusters = ", ".join(
        f"{{ position_body_m = {list(place)}, direction_body = {list(push)}, thrust_n = {thrust_n} }}"
        for (place, push), thrust_n in zip(PLACES, THRUST_N, strict=True)
    )
    return (
        f"mass_kg = {MASS_KG}\nthrusters = [{thrusters}]\nvalves = {{ spread = 0.0, open_delay_s = {OPEN_S}, "
        f"close_delay_s = {CLOSE_S}, tank_impulse_n_s = 2000.0 }}\n{stuck}"
    )


def legs(until_s):
    rng = np.random.default_rng(3)
    for number in range(int((until_s - 14.0) / 7.0)):
        goal = {
            "x_m": float(rng.uniform(-1.0, 1.0)),
            "y_m": float(rng.uniform(-0.7, 0.7)),
            "heading_rad": float(rng.uniform(-3.0, 3.0)),
        }
        yield Request(
            round((14.0 + 7.0 * number) * 1e9), "alpha", number + 1, "test", "go_to", json.dumps(goal)
        )


def flown(fly, span_s, laboratory, more=""):
    changes = [("start_m = [0.0, 0.0]", f"start_m = [0.0, 0.0]\n{laboratory}")]
    control = '\n[mock_ups.standard.control]\ncontroller = "go_to"\n'
    flight = fly(LEARNS + control + more, changes=changes, requests=legs(span_s))
    return flight.run(span_s)


def test_hidden_valves_are_recovered_within_three_sigmas(fly):
    flight = flown(fly, 120.0, hidden())
    assert not flight.faults()
    learned = flight.of(ValvesLearned)[-1]
    wanted = np.array(THRUST_N) / RIG_THRUST_N * RIG_MASS_KG / MASS_KG
    ratios, sigmas = np.array(learned.thrust_over_mass_ratio), np.array(learned.thrust_over_mass_sigma)
    assert (np.abs(ratios - wanted) < 3.0 * sigmas).all(), (ratios, wanted, sigmas)
    assert sigmas.max() < 0.03
    torques = np.array(THRUST_N) / RIG_THRUST_N
    found, wide = np.array(learned.torque_over_inertia_ratio), np.array(learned.torque_over_inertia_sigma)
    assert (np.abs(found - torques) < 3.0 * wide).all(), (found, torques, wide)
    dead_s, dead_sigma_s = np.array(learned.dead_time_s), np.array(learned.dead_time_sigma_s)
    assert np.isfinite(dead_s).all()
    assert (np.abs(dead_s - (OPEN_S - CLOSE_S)) < 3.0 * dead_sigma_s).all(), (dead_s, dead_sigma_s)
    assert dead_sigma_s.max() < 5e-4
    # what the view and the report show of it
    newest = Newest()
    newest.put(learned)
    assert LearnedGauge("alpha").cell(newest, 0).text.startswith(f"{100 * ratios[0]:.0f} ")
    figure = LearnedFigure()
    figure.take(learned, 1.0)
    rows = figure.values()["valves_learned"]
    assert [row["valve"] for row in rows] == list(range(8))
    assert rows[5]["dead_time_s"] == dead_s[5]


def test_a_valve_that_is_found_broken_is_not_learned_from(fly):
    failure = (
        '\n[[laboratory.failures]]\nkind = "stuck_closed_valve"\nvehicle = "alpha"\nstart_s = 40.0\n'
        "parameters = { valve = 3 }\n"
    )
    flight = flown(fly, 70.0, "", failure)
    (found_ns,) = [share.stamp_ns for share in flight.of(ValveShares)][:1]
    learned = flight.of(ValvesLearned)
    assert learned[-1].stamp_ns < found_ns + 2e9
    before = [row for row in learned if row.stamp_ns < found_ns]
    assert math.isfinite(before[-1].thrust_over_mass_ratio[3])
    assert math.isnan(learned[-1].thrust_over_mass_ratio[3])


def test_without_the_key_nothing_is_learned(fly):
    assert not fly().run(9.0).of(ValvesLearned)
