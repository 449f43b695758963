"""A live mock-up on emulated motion capture: its poses come over the wire and are flown on."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.parts.fusion.messages import FixAccount, VehicleState
from groundstation.parts.motion_capture.messages import CaptureFix
from groundstation.parts.reference.messages import ReferenceState
from groundstation.recording.reader import Recording

RIG = Path(__file__).parents[3] / "examples" / "rigs" / "motion_capture.toml"

pytest.importorskip("motioncapture", reason="it comes with the extra mocap")
pytestmark = pytest.mark.slow


def test_motion_capture_delivers_fixes_and_the_mock_up_flies_on_them(launch, tmp_path):
    rig = tmp_path / "rig.toml"
    short_rest = "[mock_ups.standard.fusion]\nrest_s = 1.5\n\n[vehicles.alpha]"
    rig.write_text(RIG.read_text().replace("[vehicles.alpha]", short_rest, 1))
    run = launch(rig)
    for _ in range(3):
        run.wait_for("alpha", "flying", "armed")
    assert run.end()[0] == 0
    with Recording(run.recording) as recording:
        kinds = (CaptureFix, FixAccount, VehicleState, ReferenceState)
        found = {kind: [row.payload for row in recording.messages((kind,))] for kind in kinds}
    fixes = [fix for fix in found[CaptureFix] if fix.fix]
    span_s = (fixes[-1].stamp_ns - fixes[0].stamp_ns) * 1e-9
    assert len(fixes) > 0.7 * 50.0 * span_s  # of the rig's 50 Hz; some are hidden
    assert {account.source for account in found[FixAccount]} == {"motion_capture"}
    assert np.mean([account.used for account in found[FixAccount]]) > 0.8
    flying = [state for state in found[VehicleState] if state.status == "flying"]
    last, truth_m = flying[-1], {row.stamp_ns: row.position_table_m for row in found[ReferenceState]}
    nearest_ns = min(truth_m, key=lambda stamp_ns: abs(stamp_ns - last.stamp_ns))
    assert np.allclose(last.position_table_m, truth_m[nearest_ns], atol=5e-3)
