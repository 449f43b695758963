"""A console without a flight: its feed is filled by hand."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient
from oracles.hand_fed_console import HandSource

from groundstation.console.access import Access
from groundstation.console.feed import Feed
from groundstation.console.server import make_app
from groundstation.console.shown_console import Console
from groundstation.declarations.rig import Rig
from groundstation.parts.table import own_tables
from groundstation.rig.read import load_rig

RIG = Path(__file__).parents[4] / "examples" / "rigs" / "two_mock_ups.toml"


@pytest.fixture(scope="session")
def rig() -> Rig:
    return load_rig(RIG)


@pytest.fixture
def feed() -> Feed:
    return Feed(own_tables().payloads)


@pytest.fixture
def source(rig: Rig, feed: Feed) -> HandSource:
    return HandSource(rig, feed)


@pytest.fixture
def served(rig: Rig, source: HandSource) -> Iterator[TestClient]:
    """A console on loopback without a desk."""
    console = Console(source, rig.tables, Access())
    with TestClient(make_app(console), base_url="http://127.0.0.1:8400") as client:
        yield client
