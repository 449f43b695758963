"""Limits while a scenario flies: open, held, broken for good; in the end as the verdict has them."""

from collections.abc import Callable
from pathlib import Path

from groundstation.bus.envelope import Delivered
from groundstation.runners.make_runner import make_runner
from groundstation.scenario.flight_log import FlightLog
from groundstation.scenario.judging import judge
from groundstation.scenario.loading import made
from groundstation.scenario.standing import Standing, standings

RIG = Path(__file__).parents[4] / "examples" / "rigs" / "drawn_fixes.toml"
S = 1_000_000_000


def scenario_of(tmp_path: Path, limits: list[dict[str, object]]):
    content = {
        "name": "hold",
        "rig": str(RIG),
        "duration_s": 6.0,
        "seed": 1,
        "changes": {"mock_ups.standard.fusion.rest_s": 1.5},
        "limits": limits,
    }
    return made(content, tmp_path / "hold.toml")


def flown_by(scenario, log: FlightLog, look: Callable[[float], None]) -> None:
    def observe(delivered: Delivered, now_ns: int) -> None:
        log.take(delivered.payload, now_ns)

    runner = make_runner(scenario.rig, 1, [observe], journaled=False)
    try:
        for second in range(1, 40):
            runner.run(second * S)
            if log.zero_ns is not None:
                look((runner.now_ns - log.zero_ns) * 1e-9)
            if log.status is not None and log.status.state == "ended":
                return
    finally:
        runner.close()
    raise AssertionError("the scenario did not end")


def test_a_limit_is_open_until_its_span_is_over_or_it_is_broken_for_good(tmp_path: Path) -> None:
    vehicle = "alpha"
    scenario = scenario_of(
        tmp_path,
        [
            {"what": "position_error_rms_mm", "vehicle": vehicle, "to_s": 3.0, "below": 1000.0},
            {"what": "gas_ns", "vehicle": vehicle, "below": 1e-6},
            {"what": "position_error_rms_mm", "vehicle": vehicle, "from_s": 4.0, "below": 1e-3},
        ],
    )
    log = FlightLog(tuple(scenario.rig.vehicles))
    seen: list[tuple[float, list[Standing]]] = []
    flown_by(scenario, log, lambda t_s: seen.append((t_s, list(standings(scenario, log)))))
    for t_s, (first, gas, late) in seen:
        assert first.held is (True if t_s >= 3.0 else None)
        if t_s < 4.0:
            assert late.held is None
        if gas.held is not None:
            assert gas.held is False
    assert seen[-1][1][1].held is False, "valves pushed: no later moment takes the gas back"
    verdict = judge(scenario, log).verdict
    assert [standing.held for standing in list(standings(scenario, log))[:2]] == [
        outcome.held for outcome in verdict.limits[:2]
    ]


def test_before_t_0_nothing_stands(tmp_path: Path) -> None:
    scenario = scenario_of(tmp_path, [])
    assert list(standings(scenario, FlightLog(tuple(scenario.rig.vehicles)))) == []
