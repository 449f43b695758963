"""What holds for all tests: hypothesis draws the same examples everywhere and measures no time."""

import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result
from hypothesis import settings
from typer.testing import CliRunner

from groundstation.core import library

settings.register_profile("everywhere", deadline=None, derandomize=True)
settings.load_profile("everywhere")


@pytest.fixture(scope="session")
def groundstation() -> Callable[..., Result]:
    """The command line: words in, its result out; what it refuses is raised as it was inside."""

    def call(*words: object) -> Result:
        from groundstation.cli.main import build, spelled

        given = spelled([str(word) for word in words])
        result = CliRunner().invoke(build(given), given)
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result

    return call


@pytest.fixture(scope="session")
def own_package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder into which ``examples/own_package`` was installed, to be put on PYTHONPATH."""
    folder = tmp_path_factory.mktemp("own_package") / "installed"
    source = Path(__file__).parents[1] / "examples" / "own_package"
    words = ["install", "--quiet", "--disable-pip-version-check", "--no-deps", "--no-build-isolation"]
    done = subprocess.run(
        [sys.executable, "-m", "pip", *words, "--target", str(folder), str(source)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--core-folder", help="use the build of the core that lies here")


def pytest_configure(config: pytest.Config) -> None:
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # by a shell without job control
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if chosen := config.getoption("--core-folder"):
        library.built_folder = lambda: Path(chosen)
