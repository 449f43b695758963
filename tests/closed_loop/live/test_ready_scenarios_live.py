"""Three of the ready scenarios flown live, on the wall clock: the same files, the same verdicts."""

from pathlib import Path

import pytest

SCENARIOS = Path(__file__).parents[3] / "examples" / "scenarios"

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("name", ["leader_lost", "valve_in_formation", "hostile_commands"])
def test_a_ready_scenario_passes_live(launch, name):
    code, said = launch(SCENARIOS / f"{name}.toml").ends_by_itself(timeout_s=240.0)
    assert code == 0, said
    assert "verdict: passed" in said
