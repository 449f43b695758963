"""The package installed: a wheel from an untouched tree, and a core on a machine without a C compiler."""

import hashlib
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from oracles.detection import OracleDetector

from groundstation.core.build import compile_core
from groundstation.core.library import load_core
from groundstation.core.sources import LIBRARY
from groundstation.star_tracking import detection
from groundstation.star_tracking.detection import Detector

ROOT = Path(__file__).parents[4]
PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")
RUN = """
from groundstation.core.library import default_core
from groundstation.star_tracking.detection import detect
import groundstation, numpy
print(groundstation.__file__, default_core().name, len(detect(numpy.zeros((64, 64), numpy.uint8))))
"""


def contents(folder):
    return {
        path.relative_to(folder): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file() and path.parent.name != "__pycache__"  # Python's own, which git ignores
    }


@pytest.fixture
def clean_tree(tmp_path):
    """The files that git knows, as a checkout has them."""
    listed = subprocess.check_output(["git", "ls-files", "-z"], cwd=ROOT, text=True)
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).exists():  # else it is being removed
            (tmp_path / "tree" / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, tmp_path / "tree" / name)
    return tmp_path / "tree"


@pytest.mark.slow
def test_an_installed_wheel_works_and_leaves_the_tree_as_it_was(clean_tree, tmp_path):
    before, site = contents(clean_tree), tmp_path / "site"
    options = ("install", "--no-deps", "--no-index", "--no-build-isolation", "--target", site)
    subprocess.run([*PIP, *options, clean_tree], check=True, cwd=tmp_path)
    assert contents(clean_tree) == before
    reported = subprocess.run(
        [sys.executable, "-S", "-c", f"import sys; sys.path += {[str(site), *sys.path]}\n{RUN}"],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
    ).stdout.split()
    assert reported[0].startswith(str(site))
    assert reported[1] == "core"
    assert (site / "groundstation" / "core" / LIBRARY).exists()


@pytest.fixture
def hidden_compiler(monkeypatch, tmp_path):
    """No C compiler but ziglang, as the build takes it from the package index."""
    zig = tmp_path / "zig"
    lock = ROOT / "tools" / "requirements-zig.lock"
    got = subprocess.run([*PIP, "install", "--require-hashes", "--target", zig, "-r", lock], check=False)
    if got.returncode:
        # what is tested is the build with that compiler, which comes from the index alone
        pytest.skip("ziglang cannot be had: is the package index out of reach?")
    monkeypatch.syspath_prepend(zig)
    monkeypatch.setenv("PYTHONPATH", str(zig))
    monkeypatch.setenv("PATH", str(tmp_path / "nothing"))
    monkeypatch.delenv("CC", raising=False)


def pictures():
    rng = np.random.default_rng(4)
    for width in (0.0, 3.0):
        light = rng.normal(12.0, 1.5, (480, 640))
        for u, v in rng.uniform((10.0, 10.0), (630.0, 470.0), (40, 2)):
            ends = [(round(16 * (u + k * width)), round(16 * (v + 2.0 * k * width))) for k in (-1, 1)]
            drawn = cv2.line(np.zeros_like(light), *ends, float(rng.uniform(60, 220)), 2, cv2.LINE_AA, 4)
            light += cv2.GaussianBlur(drawn, (0, 0), 1.2)
        yield np.clip(np.rint(light), 0, 255).astype(np.uint8)


@pytest.mark.slow
def test_without_a_compiler_zig_makes_a_core_with_the_same_bits(hidden_compiler, monkeypatch, tmp_path):
    ours = Detector()
    assert shutil.which("cc") is None
    core = load_core(compile_core(tmp_path / "made", ("-Werror",)))
    monkeypatch.setattr(detection, "default_core", lambda: core)
    zigs = Detector()
    for picture in pictures():
        one, two = ours.find(picture), zigs.find(picture)
        assert len(OracleDetector().find(picture)) == len(one) > 10
        for name in ("u_px", "v_px", "flux_dn", "covariance_px2", "elongation", "streak_px"):
            assert np.array_equal(getattr(one, name), getattr(two, name)), name
