"""Whoever asks is answered, as soon after the last one as he likes, and by names that can be read."""

import json

import pytest

from groundstation.launch.asking import ask_each

pytestmark = pytest.mark.slow

TIMES = 300
"""One answer in forty went astray where publishers had to notice each new subscriber first."""


def test_every_answer_reaches_who_has_just_come_to_ask(launch, two_drawn):
    run = launch(two_drawn)
    run.wait_for("all processes are ready")
    endpoint = json.loads(next((run.folder / "groundstation").glob("*.json")).read_text())["endpoint"]
    place = {"x_m": -0.6, "y_m": 0.0, "heading_rad": 0.0}
    answered = [ask_each(endpoint, ("alpha",), "go_to", place, "me", 10.0) for _ in range(TIMES)]
    assert [sorted(each) for each in answered] == [["alpha"]] * TIMES
    run.end_in_order()
