"""What a command reads of the files and folders that it is given: nothing of it may be written over."""

from pathlib import Path

NAMES = (
    "imu.csv",
    "stars.csv",
    "meta.json",
    "truth.csv",
    "camera.json",
    "ceiling.csv",
    "anchors.csv",
    "places.csv",
    "mock_ups.toml",
)
"""Of a data set's files."""
FRAMES = "frames"


def inputs_of(*sources: Path | None) -> list[Path]:
    """Return the files, and of folders the files of a data set and of a run, there or not.

    The folder of the pictures stands for all of them.
    """
    found: list[Path] = []
    for source in sources:
        if source is None:
            continue
        if source.is_dir():
            found += [source / name for name in (*NAMES, FRAMES)]
            found += sorted(source.glob("*.mcap"))
        else:
            found.append(source)
    return found
