"""The published estimator, re-integration from each late fix, closes the loop as the default filter does."""

import math
from pathlib import Path

import pytest

from groundstation.parts.fusion.messages import FusionStatus
from groundstation.parts.reference.messages import ReferenceState
from groundstation.rig.read import parse_rig
from groundstation.runners.make_runner import make_runner

RIG = Path(__file__).parents[2] / "examples" / "rigs" / "drawn_fixes.toml"


@pytest.mark.slow
def test_the_published_method_holds_the_station():
    method = '[mock_ups.standard.fusion]\nmethod = "reintegration"\n\n'
    text = RIG.read_text().replace("[vehicles.alpha]", f"{method}[vehicles.alpha]", 1)
    off_goal_m, methods = [], set()

    def observe(delivered, now_ns):
        payload = delivered.payload
        if isinstance(payload, ReferenceState) and now_ns > 40e9:
            off_goal_m.append(math.dist(payload.position_table_m, (0.2, 0.1)))
        elif isinstance(payload, FusionStatus):
            methods.add(payload.method)

    runner = make_runner(parse_rig(text, RIG), 1, [observe], journaled=False)
    runner.run(60_000_000_000)
    runner.close()
    assert methods == {"reintegration"}
    assert math.sqrt(sum(d * d for d in off_goal_m) / len(off_goal_m)) < 0.010
