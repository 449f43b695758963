"""Verdicts and the trial behind them: words, limits and sums, each written out."""

import math

import pytest

from groundstation.control.valve_health import STUCK_CLOSED, ValveHealth, leaking, stuck_open, weak
from groundstation.supervision.finding import Finding
from groundstation.supervision.thrust_blocks import Block
from groundstation.supervision.thrust_fit import FitConfig, Misfit, ThrustFit
from groundstation.supervision.valve_hypotheses import Suspicion, Symptom
from groundstation.supervision.valve_inquiry import HISTORY_S, SURE, ValveInquiry, Verdict
from groundstation.supervision.valve_trial import CLOSED_SHARE, Explanation, Kind, ValveTrial, mixed


def one(kind=Kind.CLOSED, valve=3, size=1.0, **words):
    usual = {
        "likelihood": 20.0, "is_twice": True, "thrust_s": 0.25, "turning": 9.0, "by_rate": 9.0,
        "across": 0.0, "across_sigma": 0.0,
    }  # fmt: skip
    return Explanation(kind=kind, valve=valve, size=size, **usual | words)


@pytest.fixture
def fit(air):
    return ThrustFit(air.MODEL, FitConfig(
        imu_position_body_m=(0.03, -0.02), gyro_density_rad_s_rthz=1e-4, acc_density_m_s2_rthz=1e-4,
    ))  # fmt: skip


def block(opened=(), turned=(), edges=(), ends=(), span_s=0.02):
    by_valve = {
        name: [dict(row).get(valve, 0.0) for valve in range(8)]
        for name, row in {"open_shares": opened, "rate_shares": turned, "edges": edges, "ends": ends}.items()
    }
    # neither a trial nor an inquiry takes notice of sag, crowds and turned_s
    none = [0.0] * 8
    return Block(
        span_s=span_s,
        rate_rad_s=0.0,
        force_m_s2=(0.0, 0.0),
        sagged_shares=by_valve["open_shares"],
        crowds=none,
        turned_s=none,
        is_after_gap=False,
        **by_valve,
    )


class TestVerdict:
    @pytest.mark.parametrize(
        ("best", "health"),
        [
            (one(), STUCK_CLOSED),
            (one(Kind.WEAK, size=0.6), weak(0.4)),
            (one(Kind.OPEN, size=0.75), stuck_open(0.75)),
            (one(Kind.OPEN, size=0.7), leaking(0.7)),
            (one(Kind.OPEN, size=2.5), stuck_open(2.0)),
        ],
    )
    def test_what_the_valve_gives_now(self, best, health):
        [(valve, found)] = Verdict(best, (), False).health().items()
        assert valve == 3
        assert isinstance(found, ValveHealth)
        assert (found.open_share, found.shut_share) == pytest.approx((health.open_share, health.shut_share))

    def test_of_those_that_cannot_be_told_apart_nothing_is_known(self):
        assert Verdict(one(), (one(valve=1),), False).health() == {}
        assert Verdict(one(Kind.SUPPLY, -1), (), False).health() == {}
        assert Verdict(one(Kind.OPEN, is_steady=False), (), False).health() == {}
        assert list(Verdict(one(valve=0), (), False).health()) == [0]

    @pytest.mark.parametrize(
        ("best", "fault", "detail"),
        [
            (one(), "valve_stuck_closed", "valve 3 gives no thrust when commanded (0.25 s of it)"),
            (one(Kind.WEAK, size=0.6), "valve_weak", "valve 3 gives 40% of its thrust (0.25 s of it)"),
            (
                one(Kind.OPEN, size=0.65),
                "valve_stuck_open",
                "valve 3 gives its thrust that was not commanded (0.25 s of it)",
            ),
            (
                one(Kind.OPEN, size=0.64),
                "valve_stuck_open",
                "valve 3 gives a part of its thrust that was not commanded (0.25 s of it)",
            ),
        ],
    )
    def test_in_words(self, best, fault, detail):
        assert Verdict(best, (), False).findings() == (Finding(fault, detail, "valve 3"),)

    def test_supply_in_words(self):
        [found] = Verdict(one(Kind.SUPPLY, -1), (), False).findings()
        assert found == Finding(
            "valve_weak", "all valves at half thrust or less: supply pressure", "all valves"
        )

    def test_what_may_as_well_be_open_is_said_of_one(self):
        rivals = (one(Kind.OPEN, 5), one(Kind.OPEN, 1), one(Kind.WEAK, 2, 0.5))
        first, second = Verdict(one(), rivals, False).findings()
        assert first.detail.endswith(
            "cannot be told apart from valve 1 (valve_stuck_open), 2 (valve_weak), 5 (valve_stuck_open)"
        )
        assert second.id == "valve_stuck_open"
        assert second.detail.startswith("valve 5 gives its thrust that was not commanded")
        assert second.detail.endswith("cannot be told apart from valve 3 (valve_stuck_closed)")
        assert len(Verdict(one(Kind.OPEN), (one(Kind.OPEN, 5),), False).findings()) == 1


class TestTrial:
    def sums(self, columns, misfits, ends):
        """Likelihood at the best size of one explanation, written out: (felt x, y, turning) of each block."""
        force = squared = turn = turn_squared = rate = before = 0.0
        for (x, y, turning), misfit in zip(columns, misfits, strict=True):
            force += (x * misfit.force_m_s2[0] + y * misfit.force_m_s2[1]) / misfit.force_variance
            squared += (x * x + y * y) / misfit.force_variance
            moved = rate + 0.01 * (before + turning)
            turn += moved * misfit.rate_rad_s / misfit.rate_variance
            turn_squared += moved**2 / misfit.rate_variance
            rate, before = (1.0 - misfit.rate_gain) * moved, turning
        size = min(max((force + turn) / (squared + turn_squared), ends[0]), ends[1])
        likelihood = size * (force + turn) - 0.5 * size**2 * (squared + turn_squared)
        turning = 0.5 * size**2 * turn_squared
        return size, likelihood, turning, size * turn - turning

    def test_every_explanation_against_its_sums(self, fit):
        fit.gains = [1.1, 0.9, 1.0, 1.2, 0.8, 1.05, 0.95, 1.15]
        opened = [{0: 0.5, 3: 0.8, 6: 0.2}, {0: 0.9, 3: 0.1, 5: 0.4}, {1: 0.3, 3: 0.7}]
        turned = [{0: 0.4, 3: 0.7, 6: 0.3}, {0: 1.0, 3: 0.2, 5: 0.3}, {1: 0.2, 3: 0.8}]
        edges = [{0: 0.6, 3: 0.9}, {0: 0.2, 3: 0.8, 5: 0.5}, {1: 0.4, 3: 0.6}]
        ends = [{0: 0.1, 3: 0.3}, {0: 0.2, 3: 0.7, 5: 0.1}, {1: 0.1, 3: 0.05}]
        given = [block(*rows) for rows in zip(opened, turned, edges, ends, strict=True)]
        misfits = [
            Misfit((-0.010, 0.004), 2e-5, 1e-4, 1e-6, 0.5, 0.0),
            Misfit((0.006, -0.012), 3e-5, -2e-4, 2e-6, 0.4, 0.0),
            Misfit((-0.004, -0.005), 1e-5, 3e-4, 1e-6, 0.3, 0.0),
        ]
        trial = ValveTrial(
            fit, [(n, *row) for n, row in enumerate(zip(given, misfits, strict=True))], [0], [], 1.0
        )
        found = {}
        for each in trial.explanations():
            found.setdefault((each.kind in (Kind.CLOSED, Kind.WEAK), each.kind, each.valve), []).append(each)

        def check(key, columns, limits):
            sums = self.sums(columns, misfits, limits)
            rows = [r for k, rows in found.items() for r in rows if k[0] == key[0] and k[2] == key[2]
                    and (key[0] or k[1] is key[1])]  # fmt: skip
            assert any(
                (r.size, r.likelihood, r.turning, r.by_rate) == pytest.approx(sums, rel=1e-9, abs=1e-12)
                for r in rows
            )

        for valve, (sx, sy, st) in enumerate(fit.signatures):
            gain = fit.gains[valve]
            o = [each.open_shares[valve] for each in given]
            r = [each.rate_shares[valve] for each in given]
            closed = [(-gain * a * sx, -gain * a * sy, -gain * b * st) for a, b in zip(o, r, strict=True)]
            if any(o):
                check((True, Kind.CLOSED, valve), closed, (0.4, 1.0))
            leak = [((1 - a) * sx, (1 - a) * sy, (1 - b) * st) for a, b in zip(o, r, strict=True)]
            check((False, Kind.OPEN, valve), leak, (0.1, 1.2))

        def all_of(amount, turning):
            return [
                tuple(
                    sum(
                        fit.gains[v] * (amount if axis < 2 else turning)(each, v) * fit.signatures[v][axis]
                        for v in range(8)
                    )
                    for axis in range(3)
                )
                for each in given
            ]

        check((False, Kind.SUPPLY, -1),
              all_of(lambda b, v: -b.open_shares[v], lambda b, v: -b.rate_shares[v]), (0.4, 1.0))  # fmt: skip
        for late in (
            lambda b, v: -(b.edges[v] - b.ends[v]) / b.span_s,
            lambda b, v: b.ends[v] / b.span_s,
        ):
            check((False, Kind.TIMING, -1), all_of(late, late), (-0.008, 0.008))

    def test_what_is_across(self, fit):
        # half of valve 0's thrust is missing, and as much force again a quarter of a turn off it
        sx, sy, _ = fit.signatures[0]
        misfit = Misfit((-0.5 * sx - 0.2 * sy, -0.5 * sy + 0.2 * sx), 1e-6, 0.0, 1.0, 0.0, 0.0)
        trial = ValveTrial(fit, [(1, block({0: 1.0}), misfit)], [1], [], 1.0)
        best = next(each for each in trial.explanations() if (each.kind, each.valve) == (Kind.WEAK, 0))
        assert best.size == pytest.approx(0.5)
        assert best.likelihood == pytest.approx(0.5 * 0.25 * fit.sizes[0] ** 2 / 1e-6)
        assert best.thrust_s == pytest.approx(0.5 * 0.02)
        assert best.across == pytest.approx(0.4)
        assert best.across_sigma == pytest.approx(1e-3 / fit.sizes[0] / 0.5)

    @pytest.mark.parametrize(("size", "kind"), [(0.75, Kind.CLOSED), (0.76, Kind.CLOSED), (0.74, Kind.WEAK)])
    def test_how_much_has_to_be_missing_to_be_closed(self, fit, size, kind):
        assert CLOSED_SHARE == 0.75
        sx, sy, _ = fit.signatures[2]
        share = size + 1e-9
        gone = Misfit((-share * sx, -share * sy), 1e-6, 0.0, 1e9, 0.0, 0.0)
        trial = ValveTrial(fit, [(1, block({2: 1.0}), gone)],
                           [1], [], 1.0)  # fmt: skip
        found = [
            each for each in trial.explanations() if each.valve == 2 and each.kind in (Kind.CLOSED, Kind.WEAK)
        ]
        assert [each.kind for each in found] == [kind]

    def test_a_moment_of_beginning_counts_from_its_block_on(self, fit):
        sx, sy, _ = fit.signatures[0]
        still = Misfit((0.0, 0.0), 1e-6, 0.0, 1e9, 0.0, 0.0)
        gone = Misfit((-sx, -sy), 1e-6, 0.0, 1e9, 0.0, 0.0)
        rows = [(1, block({0: 1.0}), still), (2, block({0: 1.0}), gone)]
        whole = 0.5 * fit.sizes[0] ** 2 / 1e-6
        by_onset = [ValveTrial(fit, rows, onsets, [], 1.0).explanations() for onsets in ([1], [2], [2, 1, 2])]
        found = [
            next(each for each in rows if each.valve == 0 and each.kind in (Kind.CLOSED, Kind.WEAK))
            for rows in by_onset
        ]
        assert [each.likelihood for each in found] == pytest.approx([0.5 * whole, whole, whole])
        assert [each.thrust_s for each in found] == pytest.approx([0.5 * 0.04, 0.02, 0.02])

    def test_two_stretches_have_to_speak_for_it(self, fit):
        sx, sy, _ = fit.signatures[0]
        gone = Misfit((-sx, -sy), 1e-6, 0.0, 1e9, 0.0, 0.0)
        whole = 0.5 * fit.sizes[0] ** 2 / 1e-6
        rows = [(number, block({0: 1.0}), gone) for number in (1, 2)]
        for marks, witness, is_twice in [
            ([1], 0.99 * whole, True), ([1], 1.01 * whole, False),
            ([2], 0.5 * whole, False), ([], 1.0, False),
        ]:  # fmt: skip
            trial = ValveTrial(fit, rows, [1], marks, witness)
            found = next(
                each for each in trial.explanations() if each.valve == 0 and each.kind is Kind.CLOSED
            )
            assert found.is_twice is is_twice


def test_a_mixture_by_hand():
    total, chance = mixed(math.log(2.0), math.log(3.0), 0.25)
    assert total == pytest.approx(math.log(0.75 * 2.0 + 0.25 * 3.0))
    assert chance == pytest.approx(0.75 / 2.25)
    total, chance = mixed(math.log(3.0), math.log(2.0), 0.9)
    assert (total, chance) == pytest.approx((math.log(2.1), 1.8 / 2.1))


class TestInquiry:
    THRESHOLD = 20.0

    def fed(self, fit, share, blocks, wait_s=0.1, valve=0, more=(), threshold=THRESHOLD):
        """Blocks in which a valve gives less, an alarm after each; the first verdict and when it came."""
        inquiry = ValveInquiry(fit, threshold, 0.02, wait_s)
        sx, sy, _ = fit.signatures[valve]
        for number in range(1, blocks + 1):
            opened = {valve: 1.0, **dict(more)}
            # the size of it is a few sigma a block, so that it takes some
            variance = 0.5 * fit.sizes[valve] ** 2 / 6.0
            inquiry.take(block(opened), Misfit((-share * sx, -share * sy), variance, 0.0, 1e9, 0.0, 0.0))
            inquiry.alarm([Suspicion(Symptom.CLOSED, valve, evidence=threshold, blocks=number)])
            verdict = inquiry.verdict()
            if verdict is not None:
                assert not inquiry.is_open
                return verdict, number
        assert inquiry.is_open
        return None, blocks

    def test_constants(self):
        assert (SURE, HISTORY_S) == (7.0, 10.0)

    def test_a_verdict_waits_for_the_whole_evidence(self, fit):
        # 6 a block: 30 are reached with the fifth, and two others could be it: 5 blocks of waiting more
        verdict, number = self.fed(fit, 1.0, 30)
        assert (verdict.best.kind, verdict.best.valve) == (Kind.CLOSED, 0)
        assert number == 5 + 5
        assert self.fed(fit, 1.0, 30, wait_s=0.2)[1] == 5 + 10
        assert not verdict.is_hand

    def test_without_an_alarm_there_is_none(self, fit):
        inquiry = ValveInquiry(fit, self.THRESHOLD, 0.02, 0.1)
        inquiry.take(block({0: 1.0}), Misfit((1.0, 0.0), 1e-6, 0.0, 1e9, 0.0, 0.0))
        assert inquiry.verdict() is None
        assert not inquiry.is_open

    def test_an_alarm_that_nothing_agrees_with_is_forgotten_after_ten_seconds(self, fit):
        inquiry = ValveInquiry(fit, self.THRESHOLD, 0.02, 0.1)
        still = block(), Misfit((0.0, 0.0), 1e-6, 0.0, 1e9, 0.0, 0.0)
        inquiry.take(*still)
        inquiry.alarm([Suspicion(Symptom.CLOSED, 0, evidence=self.THRESHOLD, blocks=1)])
        for _ in range(500):
            inquiry.take(*still)
            assert inquiry.is_open
            assert inquiry.verdict() is None
        inquiry.take(*still)
        assert not inquiry.is_open
