"""Whatever draws what it found does so by the same option."""

import pytest

DRAWING = (
    ("fusion", "run"),
    ("star-tracker", "solve"),
    *(
        ("calibrate", name)
        for name in (
            "allan", "board", "delay", "gyro-scale", "joint", "laboratory", "lens", "mount", "overhead",
            "survey", "table-map", "temperature", "tilt", "zero-offset", "zero-offset-fit",
        )
    ),
)  # fmt: skip


@pytest.mark.parametrize("words", DRAWING, ids=" ".join)
def test_the_option_is_called_and_explained_alike(groundstation, words):
    text = " ".join(groundstation(*words, "--help").stdout.split())
    assert "--plot <path> PNG to draw as well." in text
