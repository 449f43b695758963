"""A controller from another package hangs in a process of its own; the state lives on to brake with."""

import itertools
import os
import signal
from pathlib import Path

import pytest

from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.valves.messages import ValveSelection
from groundstation.recording.reader import Recording

RIG = Path(__file__).parents[3] / "examples" / "own_package" / "rig.toml"
FLYING = ("alpha", "flying", "armed")

pytestmark = pytest.mark.slow


def child(pid, name):
    """Process number of the launcher's child of that name."""
    found = [
        int(each)
        for task in Path(f"/proc/{pid}/task").glob("*/children")
        for each in task.read_text().split()
    ]
    (only,) = [
        each
        for each in found
        if f"groundstation {name}\0".encode() in Path(f"/proc/{each}/cmdline").read_bytes()
    ]
    return only


def test_a_hanging_controller_is_braked_for_and_started_again(launch, own_package, tmp_path, monkeypatch):
    path = os.pathsep.join([str(own_package), os.environ.get("PYTHONPATH", "")]).rstrip(os.pathsep)
    monkeypatch.setenv("PYTHONPATH", path)
    rig = tmp_path / "rig.toml"
    short_rest = "[mock_ups.standard.fusion]\nrest_s = 1.5\n\n[vehicles.alpha]"
    rig.write_text(RIG.read_text().replace("[vehicles.alpha]", short_rest))
    run = launch(rig)
    run.wait_for("alpha: flying")
    for _ in range(2):
        run.wait_for(*FLYING)
    os.kill(child(run.process.pid, "alpha_controller"), signal.SIGSTOP)
    run.wait_for("alpha_controller hangs")
    run.wait_for("all processes are ready")
    for _ in range(2):
        run.wait_for(*FLYING)
    run.end_in_order()
    with Recording(run.recording) as recording:
        states = [row.payload for row in recording.messages((VehicleState,))]
        flying = [state for state in states if state.status == "flying"]
        choices = [row.payload for row in recording.messages((ValveSelection,))]
    silence_s = max(b.stamp_ns - a.stamp_ns for a, b in itertools.pairwise(flying)) * 1e-9
    assert silence_s < 1.0
    phases = [list(group) for _, group in itertools.groupby(choices, lambda choice: choice.source)]
    assert [phase[0].source for phase in phases[-3:]] == ["controller", "brake", "controller"]
    braking = phases[-2]
    began_ns, ended_ns = braking[0].stamp_ns, braking[-1].stamp_ns
    assert ended_ns - began_ns > 2e9
    braked = [state for state in flying if began_ns + 2e9 < state.stamp_ns < ended_ns]
    assert braked
    assert max(abs(speed) for state in braked for speed in state.velocity_table_m_s) < 0.01
