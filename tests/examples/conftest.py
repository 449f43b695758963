"""How the tests reach the benches, which nothing else imports."""

import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture
def bench(monkeypatch):
    """Imports a module of tools/bench as tools/bench.py does."""
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    return lambda name: importlib.import_module(f"bench.{name}")


@pytest.fixture(scope="module")
def bench_limits():
    """The rows' limits, for property tests, which take no fixture of a single test."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "tools"))
        yield importlib.import_module("bench.limits")
