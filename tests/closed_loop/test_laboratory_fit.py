"""An emulated laboratory with hidden values is fitted to a flight, and the fit is flown.

`python tools/bench.py --only laboratory_fit` does this over 20 seeds.
"""

import importlib
import json
import re
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from groundstation.parts.supervision.messages import Supervision
from groundstation.rig.read import parse_rig
from groundstation.runners.make_runner import make_runner

TOOLS = Path(__file__).parents[2] / "tools"
SEEDS, FLIGHT_S = (2, 3), 60.0
pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


@pytest.fixture(scope="module")
def tools():
    sys.path.insert(0, str(TOOLS))  # its parts import each other by name
    try:
        flights = importlib.import_module("laboratory_flights")
        yield flights, importlib.import_module("bench.laboratory_fit")
    finally:
        sys.path.remove(str(TOOLS))


def test_hidden_values_come_back_and_what_was_written_flies(tools, groundstation, tmp_path):
    flights, bench = tools
    every = []
    for seed in SEEDS:
        recording, out = tmp_path / f"hidden_{seed}.mcap", tmp_path / f"laboratory_{seed}.toml"
        plot = out.with_suffix(".png")
        hidden = flights.record(seed, recording, FLIGHT_S)
        done = groundstation("calibrate", "laboratory", recording, "--out", out, "--plot", plot)
        assert done.exit_code == 0, done.output
        assert plot.read_bytes().startswith(b"\x89PNG")
        fitted = json.loads(out.with_suffix(".json").read_text())
        deviations, unseen = bench.errors_over_sigma(asdict(hidden), fitted)
        assert unseen <= 2, fitted
        every += [value for values in deviations.values() for value in values]
        rehearsal = flights.station(hidden, seed) + "\n" + out.read_text()
        assert re.search(r"^thrust_n = .*# ± ", rehearsal, re.MULTILINE)
    size = np.abs(every)
    assert (size < 3.0).mean() >= 0.9
    assert size.max() < 6.0
    assert 0.3 < np.sqrt((size**2).mean()) < 2.0
    assert "flying" in modes_of(rehearsal, tmp_path)


def modes_of(text, folder):
    """Modes of a rig's vehicle in its first ten seconds."""
    modes = []

    def keep(delivered, now_ns):
        if isinstance(delivered.payload, Supervision):
            modes.append(str(delivered.payload.mode))

    runner = make_runner(parse_rig(text, folder / "rehearsal.toml"), 1, [keep], journaled=False)
    try:
        runner.run(10_000_000_000)
    finally:
        runner.close()
    return modes
