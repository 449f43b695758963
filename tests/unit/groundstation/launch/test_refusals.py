"""A child that refuses is a wrong rig, whenever it ends between the launcher's looks."""

import time
from pathlib import Path

import pytest

from groundstation.declarations.errors import RigError
from groundstation.launch.child import Child, start_python
from groundstation.launch.launcher import Launcher
from groundstation.rig.read import parse_rig, read_text

RIG = Path(__file__).parents[4] / "examples" / "rigs" / "drawn_fixes.toml"


@pytest.fixture
def launcher(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    text = read_text(RIG)
    launcher = Launcher(parse_rig(text, RIG), text, RIG, None, lambda line: None)
    yield launcher
    launcher.close()


@pytest.fixture
def refusing():
    child = Child("of a test")
    words = "import sys; sys.stderr.write('groundstation: rig.toml: no such thing\\n'); sys.exit(2)"
    child.adopt(start_python(["-c", words]), 0.0)
    child.wait(time.monotonic() + 30.0)
    yield child
    child.release()


def test_it_is_raised_where_its_end_is_first_seen(launcher, refusing):
    for look in (launcher._look_after_laboratory, launcher._look_after):
        launcher._addresses = None if look == launcher._look_after_laboratory else {}
        with pytest.raises(RigError, match=r"^rig.toml: no such thing$"):
            look(refusing, time.monotonic())
