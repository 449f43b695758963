"""What holds for all tests: hypothesis draws the same examples everywhere and measures no time."""

from pathlib import Path

import pytest
from hypothesis import settings

from groundstation.core import library

settings.register_profile("everywhere", deadline=None, derandomize=True)
settings.load_profile("everywhere")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--core-folder", help="use the build of the core that lies here")


def pytest_configure(config: pytest.Config) -> None:
    if chosen := config.getoption("--core-folder"):
        library.built_folder = lambda: Path(chosen)
