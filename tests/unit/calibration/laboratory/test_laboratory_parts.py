"""The parts of the fit of a laboratory, each against something worked out another way."""

import numpy as np
import pytest

from calibration.laboratory.camera import grid_of
from calibration.laboratory.coil_spans import coil_spans
from calibration.laboratory.rounding import noise_of_poll, rounded
from calibration.laboratory.thrust_course import POLL_S, Openings, Timing, Windows, course, openings
from drivers.valve_bus.messages import Arm, Stop, ValveCommand
from drivers.valve_bus.protocol import encode

MS = 1_000_000
BITRATE = 500_000.0
ON_THE_WIRE_NS = 244_200  # 111 bits, a tenth stuffed


def frames(*rows):
    made = [(round(at_ms * MS), encode(message)) for at_ms, message in rows]
    return [(at_ns, frame.arbitration_id, frame.data) for at_ns, frame in made]


def on(valve, on_ms):
    return tuple(on_ms if number == valve else 0 for number in range(8))


def spans(*rows, bus_index=0):
    found = coil_spans(frames((0.0, Arm(0, is_armed=True)), *rows), bus_index, BITRATE)
    return [
        (valve, round((start - ON_THE_WIRE_NS) / MS, 3), round((stop - ON_THE_WIRE_NS) / MS, 3))
        for valve, start, stop in zip(found.valve, found.start_ns, found.stop_ns, strict=True)
    ]


def test_a_pulse_begins_when_its_frame_is_complete_and_lasts_as_long_as_it_says():
    assert spans((10.0, ValveCommand(0, 1, 1, on(3, 40)))) == [(3, 10.0, 50.0)]


def test_an_unchanged_pulse_id_changes_nothing():
    assert spans((10.0, ValveCommand(0, 1, 1, on(3, 40))), (30.0, ValveCommand(0, 2, 1, on(3, 20)))) == [
        (3, 10.0, 50.0)
    ]


def test_a_new_pulse_id_prolongs_what_is_open_and_closes_the_rest():
    rows = [(10.0, ValveCommand(0, 1, 1, (60, 60, *[0] * 6))), (50.0, ValveCommand(0, 2, 2, on(1, 60)))]
    assert spans(*rows) == [(0, 10.0, 50.0), (1, 10.0, 110.0)]


def test_silence_of_100_ms_closes():
    rows = [(10.0, ValveCommand(0, 1, 1, on(2, 127))), (400.0, ValveCommand(0, 2, 2, on(2, 20)))]
    assert spans(*rows) == [(2, 10.0, 110.0), (2, 400.0, 420.0)]


def test_a_stop_closes_at_once_and_other_vehicles_are_not_ours():
    rows = [
        (10.0, ValveCommand(0, 1, 1, on(2, 100))),
        (20.0, ValveCommand(1, 1, 5, on(4, 100))),
        (30.0, Stop(0)),
        (50.0, ValveCommand(0, 2, 2, on(2, 20))),
    ]
    [(valve, start, stop)] = spans(*rows)
    assert (valve, start) == (2, 10.0)
    assert stop == pytest.approx(30.0, abs=0.2)  # a shorter frame


def coils(*pulses):
    return type("Coils", (), {"valve": np.array([valve for valve, _, _ in pulses])})


def opened(pulses, timing):
    start, stop = (np.array([pulse[k] for pulse in pulses], dtype=float) for k in (1, 2))
    return openings(coils(*pulses), start, stop, timing, 1e-3)


def test_a_coil_released_before_the_valve_opens_opens_nothing_and_one_in_between_is_doubtful():
    timing = Timing(0.020, 0.005, 0.004, 1.0)
    found = opened([(0, 10.0, 25.0), (0, 100.0, 119.5), (0, 200.0, 250.0)], timing)
    assert found.begin.tolist() == [120.0, 220.0]
    assert found.is_doubtful.tolist() == [True, False]


def test_a_valve_energised_again_before_it_has_closed_stays_open():
    timing = Timing(0.006, 0.010, 0.004, 1.0)
    found = opened([(5, 10.0, 60.0), (5, 65.0, 100.0)], timing)
    assert (found.begin.tolist(), found.end.tolist()) == ([16.0], [110.0])


def test_thrust_and_its_integral_are_those_of_small_steps():
    timing = Timing(0.0, 0.0, 0.0037, 0.95)
    begin, end = np.array([10.31, 14.7, 80.2]), np.array([57.83, 62.9, 81.05])
    pulses = Openings(np.array([1, 4, 1]), begin, end, np.zeros(3, dtype=bool))
    found = course(pulses, timing, 150)
    step = 5e-3  # of a poll
    thrust, turned, at = np.zeros(8), np.zeros(8), []
    for number in range(29_800):
        t = number * step
        is_open = np.zeros(8)
        is_open[pulses.valve[(begin <= t) & (t < end)]] = 1.0
        target = is_open * timing.sag ** max(0.0, is_open.sum() - 1.0)
        thrust = thrust + step * POLL_S / timing.rise_s * (target - thrust)
        turned = turned + step * POLL_S * thrust
        if (number + 1) % 200 == 0:
            at.append((thrust, turned))
    assert np.abs(found.share[1:] - np.array([each[0] for each in at])).max() < 0.006  # the sag, by cells
    assert np.abs(found.turned_s[1:] - np.array([each[1] for each in at])).max() < 2e-5


def test_windows_take_the_mean_of_their_polls():
    windows = Windows(np.array([3, 7]), 4)
    assert windows.mean(np.arange(10.0)).tolist() == [1.5, 5.5]


@pytest.mark.parametrize("noise", [0.15, 0.22, 0.41, 0.8])
def test_rounding_is_what_many_polls_show(noise):
    rng = np.random.default_rng(3)
    value = np.array([0.0, 0.2, 0.5, 7.3, -4.6])
    codes = np.rint(value + noise * rng.standard_normal((400_000, len(value))))
    found = rounded(value, noise)
    assert np.abs(codes.mean(axis=0) - value - found.bias).max() < 4e-3
    assert np.abs(codes.var(axis=0) - found.variance).max() < 5e-3


@pytest.mark.parametrize("noise", [0.2, 0.41, 1.3])
def test_the_noise_of_a_poll_is_found_behind_rounding_and_averaging(noise):
    rng = np.random.default_rng(4)
    value = rng.uniform(-20.0, 20.0, 40_000)
    means = np.rint(value[:, None] + noise * rng.standard_normal((len(value), 4))).mean(axis=1)
    left = means - value - rounded(value, noise).bias
    found, slope = noise_of_poll(value, float(left.var()), 4)
    sigma = slope * left.var() * np.sqrt(2.0 / len(left))
    assert abs(found - noise) < 4.0 * sigma + 2e-3 * noise


def test_no_noise_scatters_less_than_none():
    assert np.isnan(noise_of_poll(np.linspace(0.0, 9.0, 500), 1e-9, 4)[0])


def test_pictures_lost_are_holes_in_an_even_clock():
    rng = np.random.default_rng(5)
    taken = np.flatnonzero(rng.uniform(size=1500) > 0.15)
    arrivals = 3.0 + taken / 15.0 + 0.003 * rng.standard_normal(len(taken))
    found = grid_of(arrivals)
    assert abs(found.scatter_s - 0.003) < 4.0 * 0.003 / np.sqrt(2.0 * len(taken))
    assert abs(found.period_s - 1.0 / 15.0) < 4.0 * found.period_sigma_s
    assert (found.arrivals, found.exposures) == (len(taken), taken[-1] - taken[0] + 1)


def test_arrivals_without_a_clock_are_no_grid():
    rng = np.random.default_rng(6)
    assert "even clock" in grid_of(np.cumsum(rng.exponential(0.1, 300)))
    assert "are needed" in grid_of(np.arange(5.0))
