"""No rig and no part can put a node where it would never run."""

from dataclasses import replace
from pathlib import Path

import pytest

from groundstation.declarations.errors import RigError
from groundstation.declarations.names import OF_THE_BUS, OF_THE_LAUNCHER
from groundstation.declarations.tables import Tables
from groundstation.parts.table import own_tables
from groundstation.rig.plan import processes_of
from groundstation.rig.read import parse_rig

RIG = Path(__file__).parents[4] / "examples" / "rigs" / "drawn_fixes.toml"
TEXT = RIG.read_text()
WRONG = [*sorted(OF_THE_BUS | OF_THE_LAUNCHER), "", "a/b", "*", "a*", "a b", "A", "1st", "{vehicel}_x", "ä"]
WRONG += ["a\n"]
NODES = ["fusion", "imu_reader", "failure_desk"]


@pytest.mark.parametrize("name", WRONG)
@pytest.mark.parametrize("node", NODES)
def test_a_rig_that_gives_a_node_an_impossible_process_is_refused_with_file_and_key(name, node):
    given = name.replace("\n", "\\n")
    with pytest.raises(RigError) as refused:
        parse_rig(f'{TEXT}\n[nodes.{node}]\nprocess = "{given}"\n', RIG)
    assert str(refused.value).startswith(f"{RIG}: nodes.{node}.process: {name!r} ")


@pytest.mark.parametrize("home", ["text", "function"])
@pytest.mark.parametrize("name", WRONG)
def test_a_part_whose_node_has_an_impossible_home_is_named(name, home):
    parts = list(own_tables().parts.values())
    place = next(number for number, part in enumerate(parts) if part.name == "fusion")
    process = name if home == "text" else lambda rig, vehicle: name
    row = replace(parts[place].nodes[0], process=process)
    parts[place] = replace(parts[place], nodes=(row,), package="pack")
    tables = Tables(parts, topics=[own_tables().payloads["journal"]])
    with pytest.raises(RigError) as refused:
        parse_rig(TEXT, RIG, tables=tables)
    sentence = f"{RIG}: the part 'fusion' of the package pack: the process of node 'fusion': {name!r} "
    assert str(refused.value).startswith(sentence)


def test_the_usual_names_are_taken():
    rig = parse_rig(f'{TEXT}\n[nodes.fusion]\nprocess = "{{vehicle}}_2nd"\n', RIG)
    assert "alpha_2nd" in processes_of(rig)
