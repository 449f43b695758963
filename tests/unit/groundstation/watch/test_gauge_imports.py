"""Every process imports the parts, hence their gauges: those bring nothing along that only a view needs."""

import subprocess
import sys
from pathlib import Path

import groundstation.parts

PARTS = sorted(path.parent.name for path in Path(groundstation.parts.__file__).parent.glob("*/gauges.py"))


def test_gauges_bring_no_screen_no_figures_and_no_filter_along():
    assert len(PARTS) >= 8
    code = "\n".join(
        [
            "import sys",
            *(f"import groundstation.parts.{part}.gauges" for part in PARTS),
            "heavy = {'rich', 'matplotlib', 'scipy', 'cv2', 'mcap', 'zenoh'} & set(sys.modules)",
            "assert not heavy, heavy",
        ]
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
