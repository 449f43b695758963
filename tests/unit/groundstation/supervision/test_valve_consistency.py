"""Which valve failed: one residual by hand, symmetry, delays over drawn mock-ups, and no false alarm."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.control.vehicle import VehicleModel
from groundstation.supervision.thrust_blocks import ThrustBlocks
from groundstation.supervision.thrust_fit import FitConfig, ThrustFit
from groundstation.supervision.valve_hypotheses import Symptom, ValveSuspicions
from groundstation.supervision.valve_trial import Kind, ValveTrial

MS = 1_000_000
FAULT_S = 8.0
FAULT_MS = 1e3 * FAULT_S


def only(valve, on_ms):
    return bytes(on_ms if each == valve else 0 for each in range(8))


def exact_fit(model):
    """Nothing is open but the noise: 1 mm/s^2 and 1 mrad/s in a block of 20 ms."""
    return ThrustFit(model, FitConfig(
        imu_position_body_m=(0.03, -0.02), gyro_density_rad_s_rthz=1e-3 * 0.02**0.5,
        acc_density_m_s2_rthz=1e-3 * 0.02**0.5, sag=1.0, gain_sigma=0.0, pulse_gain_sigma=0.0,
        edge_sigma_s=0.0, delay_sigma_s=0.0, zero_sigma_m_s2=0.0, force_floor_m_s2=0.0, turn_floor_rad_s2=0.0,
    ))  # fmt: skip


def still_blocks(model, commands, count):
    """Blocks of a mock-up that lies still whatever is commanded; no delays, no lag."""
    blocks = ThrustBlocks(model, (0.0, 0.0), 0.0, (0.0, 0.0), 0.02)
    for at_ms, pulse_id, on_time_ms in commands:
        blocks.command(at_ms * MS, pulse_id, on_time_ms)
    found = [blocks.sample(10 * step * MS, 0.01, 0.0, (0.0, 0.0)) for step in range(1, 2 * count + 1)]
    return [block for block in found if block is not None]


def test_the_residual_of_a_valve_that_gives_nothing_is_its_signature(air):
    # valve 0 pushes 0.22 N forward at the left rear: 0.02 m/s^2 on 11 kg, -0.033 N m, -0.132 rad/s^2 on 0.25
    fit = exact_fit(air.MODEL)
    sx, sy = 0.02 - 0.132 * 0.02, -0.132 * 0.03
    assert fit.signatures[0] == pytest.approx((sx, sy, -0.132))
    first, second = still_blocks(air.MODEL, [(0, 1, only(0, 100))], 2)
    assert first.open_shares[0] == second.open_shares[0] == 1.0
    fit.compare(first)
    misfit = fit.compare(second)
    assert misfit.force_m_s2 == pytest.approx((-sx, -sy))
    assert misfit.force_variance == pytest.approx(1e-6)
    assert misfit.rate_rad_s == pytest.approx(0.132 * 0.02)
    assert misfit.commanded_m_s2 == pytest.approx(np.hypot(sx, sy))


def test_a_block_adds_the_log_likelihood_ratio(air):
    fit = exact_fit(air.MODEL)
    suspicions = ValveSuspicions(fit)
    first, second = still_blocks(air.MODEL, [(20, 1, only(0, 100))], 2)
    fit.compare(first)
    misfit = fit.compare(second)
    assert suspicions.weigh(second, misfit)
    closed = next(case for case in suspicions.cases if case.symptom is Symptom.CLOSED and case.valve == 0)
    turn = 0.5 * 0.132 * 0.02  # mean of a block at whose beginning the thrust sets in
    assert misfit.rate_rad_s == pytest.approx(turn)
    assert closed.evidence == 8.0
    # what a trial makes of the same block, with nothing capped and the best size
    trial = ValveTrial(fit, [(1, second, misfit)], [1], [1], 1.0)
    best, *others = trial.explanations()
    assert (best.kind, best.valve, best.size) == (Kind.CLOSED, 0, pytest.approx(1.0))
    by_force = 0.5 * fit.sizes[0] ** 2 / 1e-6
    by_rate = 0.5 * turn**2 / misfit.rate_variance
    assert best.likelihood == pytest.approx(by_force + by_rate)
    assert (best.turning, best.by_rate) == pytest.approx((by_rate, by_rate))
    # while it alone is commanded, the opposite valve, open, would do the same, and so would an empty tank
    alike = {(each.kind, each.valve) for each in others if each.likelihood > best.likelihood - 1e-6}
    assert alike == {(Kind.OPEN, 2), (Kind.SUPPLY, -1)}


def test_a_rise_and_a_lag_keep_the_impulse_and_move_it(air):
    blocks = ThrustBlocks(air.MODEL, (0.006, 0.005), 0.004, (0.009, 0.004), 0.02)
    blocks.command(0, 1, only(3, 50))
    found = [blocks.sample(4 * step * MS, 0.004, 0.0, (0.0, 0.0)) for step in range(1, 101)]
    shares = np.array([block.open_shares[3] for block in found if block is not None])
    rates = np.array([block.rate_shares[3] for block in found if block is not None])
    middles = 0.02 * (np.arange(len(shares)) + 0.5)
    for values, lag_s in ((shares, 0.004 + 0.009), (rates, 0.004 + 0.004)):
        assert values.sum() * 0.02 == pytest.approx(0.049, rel=1e-3)
        centre = (values * middles).sum() / values.sum()
        assert centre == pytest.approx(0.006 + 0.0245 + lag_s, abs=1e-3)
    edges = sum(block.edges[3] for block in found if block is not None)
    ends = sum(block.ends[3] for block in found if block is not None)
    assert (edges, ends) == pytest.approx((2.0, 1.0), rel=0.05)


def test_missing_samples_begin_a_new_block(air):
    blocks = ThrustBlocks(air.MODEL, (0.0, 0.0), 0.0, (0.0, 0.0), 0.02)
    assert blocks.sample(10 * MS, 0.01, 0.0, (0.0, 0.0)) is None
    assert blocks.sample(60 * MS, 0.01, 0.0, (1.0, 0.0)) is None
    block = blocks.sample(70 * MS, 0.01, 0.0, (1.0, 0.0))
    assert block.is_after_gap
    assert block.force_m_s2 == (1.0, 0.0)


def first_found(air, seed, truth_of, *, noise=None, detector=None, order=None, seconds=16):
    """When and what was found first, and the on-time (ms) that its valve had been commanded by then."""
    rng = np.random.default_rng(seed)
    noise = noise or air.DEFAULT
    truth = truth_of(rng)
    detector = detector or air.make_detector(noise)
    chosen = air.commands(rng, seconds * 10, truth)
    for when, findings in air.fly(detector, rng, truth, chosen, noise=noise, period_ms=10, order=order):
        began = np.arange(len(chosen)) * 0.1
        spent = np.clip(1e3 * (when - began[:, None]) - 5.0, 0.0, chosen) * (began[:, None] >= FAULT_S)
        return when, findings, spent.sum(0)
    return None, (), np.zeros(8)


@pytest.mark.parametrize("noise", ["DEFAULT", "DATASHEET"])
def test_a_valve_that_stays_closed_is_named_within_a_fifth_of_a_second_of_its_on_time(air, noise):
    spent = []
    for seed in range(20):
        valve = seed % 8
        when, found, on_ms = first_found(
            air, seed, lambda rng, valve=valve: air.Truth.drawn(rng, closed={valve: FAULT_MS}),
            noise=getattr(air, noise),
        )  # fmt: skip
        named = [
            each for each in found if each.id == "valve_stuck_closed" and f"valve {valve} " in each.detail
        ]
        assert not found or when > FAULT_S
        spent.append(on_ms[valve] if named else np.inf)
    assert np.mean(np.array(spent) <= 200.0) >= 0.95


@pytest.mark.parametrize(("noise", "limit_s"), [("DEFAULT", 0.3), ("DATASHEET", 1.0)])
def test_a_valve_that_stays_open_is_named_within_a_second(air, noise, limit_s):
    delays = []
    for seed in range(20):
        valve = seed % 8
        when, found, _ = first_found(
            air, seed, lambda rng, valve=valve: air.Truth.drawn(rng, open={valve: (FAULT_MS, 1.0)}),
            noise=getattr(air, noise),
        )  # fmt: skip
        named = [each for each in found if each.id == "valve_stuck_open" and f"valve {valve} " in each.detail]
        assert not found or when > FAULT_S
        delays.append(when - FAULT_S if named else np.inf)
    assert np.mean(np.array(delays) <= limit_s) >= 0.9
    assert np.median(delays) < 0.5 * limit_s


@pytest.mark.parametrize(
    ("what", "fault"),
    [
        ({"scale": (FAULT_MS, 0.3)}, "valve_weak"),
        ({"open": (FAULT_MS, 0.3)}, "valve_stuck_open"),
        ({"pulsing": (FAULT_MS, 40, 400)}, "valve_stuck_open"),
    ],
)
def test_weak_leaking_and_pulsing_valves_are_named(air, what, fault):
    right = 0
    [(key, value)] = what.items()
    for seed in range(12):
        valve = (3 * seed) % 8
        _, found, _ = first_found(
            air, 50 + seed, lambda rng, valve=valve: air.Truth.drawn(rng, **{key: {valve: value}})
        )
        right += any(each.id == fault and f"valve {valve} " in each.detail for each in found)
    assert right >= 10


def test_what_a_weak_or_closed_valve_gives_is_known_from_then_on(air):
    for fault, least, most in (
        ({"scale": {3: (FAULT_MS, 0.3)}}, 0.2, 0.4),
        ({"closed": {3: FAULT_MS}}, 0.0, 0.0),
    ):
        rng = np.random.default_rng(4)
        truth, detector = air.Truth.drawn(rng, **fault), air.make_detector()
        found = list(air.fly(detector, rng, truth, air.commands(rng, 300, truth), period_ms=10))
        assert len(found) == 1  # what it does not give is no surprise any more
        [(valve, health)] = detector.health.items()
        assert valve == 3
        assert least <= health.open_share <= most
        assert health.shut_share == 0.0


@pytest.mark.parametrize(
    ("fault", "health"),
    [
        ({"open": {5: (FAULT_MS, 1.0)}}, (0.9, 1.2, 0.9, 1.2)),
        ({"open": {5: (FAULT_MS, 0.4)}}, (1.0, 1.0, 0.3, 0.5)),
        ({"pulsing": {5: (FAULT_MS, 40, 400)}}, None),
    ],
)
def test_what_a_valve_that_does_not_shut_gives_is_planned_with_unless_it_comes_and_goes(air, fault, health):
    rng = np.random.default_rng(9)
    truth, detector = air.Truth.drawn(rng, **fault), air.make_detector()
    found = list(air.fly(detector, rng, truth, air.commands(rng, 200, truth), period_ms=10))
    assert [each.id for each in found[0][1]] == ["valve_stuck_open"]
    if health is None:
        assert detector.health == {}
        return
    [(valve, given)] = detector.health.items()
    assert valve == 5
    assert health[0] <= given.open_share <= health[1]
    assert health[2] <= given.shut_share <= health[3]


def test_a_weak_valve_that_works_again_is_cleared(air):
    for seed in range(6):
        rng = np.random.default_rng(20 + seed)
        truth, detector = (
            air.Truth.drawn(rng, scale={2: (FAULT_MS, 0.3, 2.5 * FAULT_MS)}),
            air.make_detector(),
        )
        found = list(air.fly(detector, rng, truth, air.commands(rng, 400, truth), period_ms=10))
        assert [[each.id for each in findings] for _, findings in found] == [["valve_weak"], []]
        assert found[1][0] > 2.5 * FAULT_S
        assert detector.health == {}


def test_a_second_valve_is_found_beside_one_that_stays_closed(air):
    named = 0
    for seed in range(6):
        rng = np.random.default_rng(40 + seed)
        truth = air.Truth.drawn(rng, closed={1: FAULT_MS}, open={6: (2.5 * FAULT_MS, 1.0)})
        found = list(air.fly(air.make_detector(), rng, truth, air.commands(rng, 400, truth), period_ms=10))
        last = {each.id: each.detail for each in found[-1][1]}
        named += last.keys() == {"valve_stuck_closed", "valve_stuck_open"} and (
            "valve 6 " in last["valve_stuck_open"]
        )
    assert named >= 5


def test_a_shock_is_a_push_and_no_valve_and_is_forgotten_after_two_seconds(air):
    for seed in range(6):
        rng = np.random.default_rng(seed)
        truth = air.Truth.drawn(rng, push=(FAULT_MS, FAULT_MS + 10.0, -40.0, 10.0))
        detector = air.make_detector()
        chosen = air.commands(rng, 120, truth)
        found = list(air.fly(detector, rng, truth, chosen, period_ms=10))
        assert {each.id for _, findings in found for each in findings} == {"pushed"}
        assert FAULT_S < found[0][0] < FAULT_S + 0.06
        assert detector.findings(round(1e9 * (FAULT_S + 1.5)))
        assert detector.findings(round(1e9 * (FAULT_S + 2.5))) == ()


def test_accelerometers_whose_zero_jumps_are_named_within_a_second(air):
    for seed in range(6):
        rng = np.random.default_rng(seed)
        truth = air.Truth.drawn(rng, shift=(FAULT_MS, 0.05, -0.02))
        chosen = air.commands(rng, 120, truth)
        found = list(air.fly(air.make_detector(), rng, truth, chosen, period_ms=10))
        when = next(when for when, findings in found if any(each.id == "imu_shifted" for each in findings))
        assert FAULT_S < when < FAULT_S + 1.0
        assert not any(each.id.startswith("valve") for _, findings in found for each in findings)


@pytest.mark.parametrize("newtons", [1.2, 1.6, 3.0])
@pytest.mark.parametrize("noise", ["DEFAULT", "DATASHEET"])
def test_a_hand_that_pushes_steadily_is_no_shifted_sensor(air, noise, newtons):
    for seed in range(4):
        rng = np.random.default_rng(seed)
        angle = rng.uniform(0.0, 2.0 * np.pi)
        force = newtons * np.cos(angle), newtons * np.sin(angle)
        truth = air.Truth.drawn(rng, push=(FAULT_MS, FAULT_MS + 2500.0, *force))
        chosen = air.commands(rng, 120, truth)
        flown = air.fly(
            air.make_detector(getattr(air, noise)),
            rng,
            truth,
            chosen,
            noise=getattr(air, noise),
            period_ms=10,
        )
        assert {each.id for _, findings in flown for each in findings} == {"pushed"}


@pytest.mark.parametrize("size_m_s2", [0.3, 2.0])
def test_a_sensor_that_reads_what_no_hand_can_go_on_pushing_is_broken(air, size_m_s2):
    rng = np.random.default_rng(1)
    truth = air.Truth.drawn(rng, shift=(FAULT_MS, size_m_s2, 0.0))
    found = list(air.fly(air.make_detector(), rng, truth, air.commands(rng, 120, truth), period_ms=10))
    when = next(when for when, findings in found if any(each.id == "imu_shifted" for each in findings))
    carried_s = np.sqrt(2.0 / size_m_s2)  # until a hand would have carried it a metre
    assert max(0.8, carried_s) - 0.1 < when - FAULT_S < max(0.8, carried_s) + 0.2


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("noise", "period_ms"), [("DEFAULT", 4), ("DEFAULT", 10), ("DATASHEET", 10)])
def test_healthy_mock_ups_with_all_that_is_not_known_of_them_are_not_accused(air, seed, noise, period_ms):
    rng = np.random.default_rng(1000 + seed)
    noise = getattr(air, noise)
    truth = air.Truth.drawn(rng)
    detector = air.make_detector(noise)
    chosen = air.commands(rng, 600, truth)
    assert list(air.fly(detector, rng, truth, chosen, noise=noise, period_ms=period_ms)) == []
    assert max(case.evidence for case in detector._suspicions.cases) < 0.5 * detector.threshold


@pytest.mark.parametrize("late_ms", [40, 80])
def test_valves_are_not_accused_of_commands_that_reach_them_late(air, late_ms):
    for seed in range(6):
        rng = np.random.default_rng(seed)
        truth = air.Truth.drawn(rng)
        chosen = air.commands(rng, 300, truth, busy=0.95)
        truth.late_ms = np.where(rng.random(300) < 0.1, np.round(late_ms * rng.random(300)), 0).astype(int)
        assert list(air.fly(air.make_detector(), rng, truth, chosen, period_ms=10)) == []


def test_a_valve_is_named_between_late_commands(air):
    named = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        truth = air.Truth.drawn(rng, open={5: (FAULT_MS, 1.0)})
        chosen = air.commands(rng, 160, truth)
        truth.late_ms = np.where(rng.random(160) < 0.1, np.round(60 * rng.random(160)), 0).astype(int)
        found = list(air.fly(air.make_detector(), rng, truth, chosen, period_ms=10))
        named += [each.id for each in found[0][1]] == ["valve_stuck_open"] and found[0][0] < FAULT_S + 1.0
    assert named >= 7


@pytest.mark.parametrize("seed", [3, 4])
def test_another_order_of_the_valves_names_the_same_valve(air, seed):
    order = np.random.default_rng(seed).permutation(8)
    model = VehicleModel(11.0, 0.25, tuple(air.MODEL.valves[valve] for valve in order))
    fault = lambda rng: air.Truth.drawn(rng, open={5: (FAULT_MS, 1.0)})  # noqa: E731
    when, found, _ = first_found(air, seed, fault)
    when_too, found_too, _ = first_found(
        air, seed, fault, detector=air.make_detector(model=model), order=order
    )
    assert when == when_too
    place = int(np.flatnonzero(order == 5)[0])
    assert [each.id for each in found] == [each.id for each in found_too] == ["valve_stuck_open"]
    assert found[0].detail.replace("valve 5", f"valve {place}") == found_too[0].detail


def test_valves_that_do_the_same_cannot_be_told_apart_and_both_are_named(air):
    twins = list(air.MODEL.valves)
    twins[1] = twins[0]
    model = replace(air.MODEL, valves=tuple(twins))
    detector = air.make_detector(model=model)
    signature = ThrustFit(model, FitConfig(
        imu_position_body_m=air.ARM_M, gyro_density_rad_s_rthz=6.7e-5, acc_density_m_s2_rthz=6.5e-5,
    )).signatures[0]  # fmt: skip
    for step in range(1, 300):
        on = step > 100
        rate = signature[2] * 0.01 * max(0, step - 100)
        x, y = (signature[0] * on, signature[1] * on)
        centripetal = rate * rate
        force = (x - centripetal * air.ARM_M[0], y - centripetal * air.ARM_M[1])
        detector.sample(step * 10 * MS, 0.01, rate, force)
    [finding] = detector.findings(3000 * MS)
    assert finding.id == "valve_stuck_open"
    assert "valve 0 " in finding.detail
    assert "cannot be told apart from valve 1" in finding.detail


def test_findings_stay_until_they_are_reset(air):
    rng = np.random.default_rng(1)
    truth = air.Truth.drawn(rng, open={2: (1000.0, 1.0)})
    detector = air.make_detector()
    found = list(air.fly(detector, rng, truth, air.commands(rng, 40, truth), period_ms=10))
    assert len(found) == 1
    detector.start((0.0, 0.0))
    assert detector.findings(0) == found[0][1]
    detector.reset()
    assert detector.findings(0) == ()


def test_the_threshold_is_that_of_the_wanted_false_alarms(air):
    # 33 tests, 10 h of blocks of 20 ms, one false alarm in a hundred such flights
    assert air.make_detector().threshold == pytest.approx(np.log(33 * 36_000 / 0.02 / 0.01))


def test_a_sample_that_is_no_number_is_a_hole_and_spoils_nothing(air):
    rng = np.random.default_rng(1)
    truth = air.Truth.drawn(rng, open={2: (3000.0, 1.0)})
    detector = air.make_detector()
    assert not detector.sample(10 * MS, 0.01, np.nan, (0.0, 0.0))
    assert not detector.sample(20 * MS, 0.01, 0.0, (0.0, np.inf))
    found = list(air.fly(detector, rng, truth, air.commands(rng, 60, truth), period_ms=10))
    assert [each.id for each in found[0][1]] == ["valve_stuck_open"]
