"""Layouts of Foxglove and Lichtblick show what there is: every path names a topic, a field and an element."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from groundstation.bus.ros_schema import is_standard, schema_text
from groundstation.parts.table import installed_tables
from groundstation.watch.pick import picked

LAYOUTS = sorted((Path(__file__).parents[2] / "examples" / "layouts").glob("*.json"))
VEHICLES = ("alpha", "beta")
PAYLOADS = installed_tables().payloads
OF_THE_SERVER = {"/tf", "/table"}


def paths_of(value: object) -> Iterator[str]:
    """Every text of a layout that is a path of messages."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from paths_of(inner)
            if key.startswith("/"):
                yield key
    elif isinstance(value, list):
        for inner in value:
            yield from paths_of(inner)
    elif isinstance(value, str) and value.startswith("/"):
        yield value


def panels_of(layout: object) -> Iterator[str]:
    if isinstance(layout, str):
        yield layout
    else:
        yield from panels_of(layout["first"])
        yield from panels_of(layout["second"])


def test_there_are_layouts():
    assert len(LAYOUTS) >= 3


@pytest.mark.parametrize("file", LAYOUTS, ids=lambda file: file.stem)
def test_every_path_names_something_that_is_published(file):
    paths = list(paths_of(json.loads(file.read_text())))
    assert paths
    for path in paths:
        topic, _, field = path.partition(".")
        if topic in OF_THE_SERVER:
            continue
        pick = picked(topic, PAYLOADS, VEHICLES)
        if not field:
            continue
        if is_standard(pick.kind):  # nested in ROS 2, flat with us
            for name in field.split("."):
                assert re.search(rf" {name}$", schema_text(pick.kind), re.MULTILINE), path
        else:
            picked(path, PAYLOADS, VEHICLES)


@pytest.mark.parametrize("file", LAYOUTS, ids=lambda file: file.stem)
def test_every_panel_that_is_laid_out_is_set_up_and_none_is_left_over(file):
    layout = json.loads(file.read_text())
    assert sorted(panels_of(layout["layout"])) == sorted(layout["configById"])
