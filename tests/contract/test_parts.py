"""Contracts over the parts: what they declare fits together, sections and actions refuse what is unknown."""

import json
import math
import re
import tomllib
from pathlib import Path

import pytest
from pydantic import ValidationError

from groundstation.bus.cdr import codec_of
from groundstation.bus.journal import Journal
from groundstation.declarations.errors import RigError
from groundstation.declarations.fix import PoseFix
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Action, ArgumentError, Request
from groundstation.declarations.section import Section
from groundstation.declarations.topic import Scope
from groundstation.declarations.view import Newest
from groundstation.parts.operation.messages import Diagnostics, Latency, RecorderStatus
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.supervision.messages import StopPress
from groundstation.parts.table import installed_tables
from groundstation.rig.read import build_rig, load_rig

ROOT = Path(__file__).parents[2]
RIG = ROOT / "examples" / "rigs" / "overhead.toml"
TABLES = installed_tables()
PARTS = TABLES.parts
NAME = re.compile(r"[a-z][a-z0-9_]*")

parts = pytest.mark.parametrize("part", PARTS.values(), ids=PARTS)
actions = pytest.mark.parametrize("action", TABLES.actions.values(), ids=TABLES.actions)


@parts
def test_a_part_is_a_folder_and_what_it_declares_is_named(part):
    assert (ROOT / "groundstation" / "parts" / part.name / "part.py").exists()
    assert part.summary
    assert "\n" not in part.summary
    declared = [kind.TOPIC.noun for kind in part.topics]
    declared += [row.name for rows in (part.nodes, part.actions, part.fix_sources) for row in rows]
    for name in (part.name, *declared):
        assert NAME.fullmatch(name), name


def test_every_folder_of_parts_is_installed():
    folders = {path.parent.name for path in (ROOT / "groundstation" / "parts").glob("*/part.py")}
    assert folders == set(PARTS)


def test_every_part_is_held_apart_from_the_others():
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    apart = next(each["modules"] for each in contracts if each["type"] == "independence")
    assert {module.rpartition(".")[2] for module in apart} == set(PARTS)


@pytest.mark.parametrize("what", ["topics", "nodes", "actions", "fix_sources"])
def test_no_name_is_declared_twice(what):
    names = [
        row.TOPIC.noun if what == "topics" else row.name
        for part in PARTS.values()
        for row in getattr(part, what)
    ]
    assert len(names) == len(set(names))
    table = {"topics": TABLES.payloads, "nodes": TABLES.nodes, "actions": TABLES.actions}.get(
        what, TABLES.fix_sources
    )
    assert set(names) == set(table) - ({Journal.TOPIC.noun} if what == "topics" else set())


def test_a_node_is_not_called_like_a_part_of_another():
    for part in PARTS.values():
        for row in part.nodes:
            assert row.name not in PARTS or row.name == part.name


@parts
def test_a_parts_nodes_ports_and_actions_name_nodes_that_exist(part):
    for row in part.nodes:
        assert issubclass(row.node_class(), Node)
    for port in part.ports:
        assert port.node in TABLES.nodes
    for action in part.actions:
        answering = TABLES.nodes[action.answered_by].node_class()
        assert Request in answering.inputs, f"{action.name}: {action.answered_by} receives no request"


@parts
def test_what_a_part_declares_is_its_own(part):
    """A node publishes topics of its part or shared ones; every topic that a part declares is published."""
    makers = {kind for row in part.nodes for kind in row.node_class().outputs} | {
        port.kind.reads for port in part.ports
    }
    # a reference may come from several systems, a press of the stop from a button on the bus
    shared = {ReferenceState, StopPress, *PARTS["operation"].topics}
    for kind in makers:
        assert TABLES.owner(kind) == part.name or kind in shared, kind.__name__
    of_runners = {Latency, Diagnostics, Request, RecorderStatus}
    everywhere = {kind for row in TABLES.nodes.values() for kind in row.node_class().outputs}
    everywhere |= {port.kind.reads for port in TABLES.ports}
    for kind in part.topics:
        assert kind in everywhere | of_runners, f"{kind.__name__} is published by nobody"


def test_a_topic_of_a_vehicle_is_published_by_one_kind_of_node():
    publishers = {}
    for row in TABLES.nodes.values():
        for kind in row.node_class().outputs:
            publishers.setdefault(kind, []).append(row.name)
    for port in TABLES.ports:
        publishers.setdefault(port.kind.reads, []).append(port.kind.__name__)
    several = {
        kind.__name__
        for kind, found in publishers.items()
        if len(found) > 1 and kind.TOPIC.scope is Scope.VEHICLE
    }
    # a rig has star fixes of its camera or of a stream, and one reference, never two; files have names
    assert several <= {"StarFix", "CalibrationInUse", "ReferenceState"}


def test_a_fix_source_makes_fixes():
    for source in TABLES.fix_sources.values():
        assert issubclass(source.payload, PoseFix)
        assert source.needs
        assert TABLES.owner(source.payload)


@pytest.mark.parametrize("kind", TABLES.payloads.values(), ids=TABLES.payloads)
def test_every_payload_documents_itself(kind):
    assert issubclass(kind, Message)
    assert kind.__doc__
    assert kind.__doc__.splitlines()[0].rstrip().endswith((".", ";")) or "\n" in kind.__doc__


@parts
def test_gauges_and_figures_are_made_and_name_topics_that_exist(part):
    known = set(TABLES.payloads.values())
    for row in part.gauges:
        gauge = row.make("alpha")
        assert known >= {*gauge.every, *gauge.newest, *gauge.rated}
        assert isinstance(gauge.cell(Newest(), 0).text, str)  # nothing is known yet
        assert isinstance(gauge.phrase(Newest(), 0), str)
    for make in part.figures:
        figure = make()
        assert known >= set(figure.inputs)
        assert isinstance(figure.values(), dict)  # of a recording that holds nothing of it


# -- sections -------------------------------------------------------------------------------------


def content() -> dict:
    """The keys of a rig file in which every part is used."""
    return tomllib.loads(RIG.read_text())


def sections(value, where=()):
    """Every table of a rig and where it stands."""
    if isinstance(value, Section):
        yield where
        for name in type(value).model_fields:
            yield from sections(getattr(value, name), (*where, name))
    elif isinstance(value, dict):
        for name, item in value.items():
            yield from sections(item, (*where, name))


PLACES = [
    place for place in sections(load_rig(RIG)) if place[:1] != ("laboratory",)
]  # the laboratory's own keys are checked by the laboratory


@pytest.mark.parametrize("place", PLACES, ids=".".join)
def test_a_section_refuses_a_key_that_it_does_not_know_by_file_and_key(place):
    given = content()
    table = given
    for name in place:
        table = table.setdefault(name, {})
    table["speeed"] = 1.0
    key = ".".join((*place, "speeed"))
    with pytest.raises(RigError) as refused:
        build_rig(given, RIG)
    assert str(refused.value) == f"{RIG}: '{key}' is no known key (a typo?)"


ADDED = {
    f"{part.name}-{of}": getattr(part, of)
    for part in PARTS.values()
    for of in ("rig", "mock_up", "vehicle")
    if getattr(part, of) is not None
}


@pytest.mark.parametrize("section", ADDED.values(), ids=ADDED)
def test_a_parts_section_refuses_unknown_keys(section):
    assert issubclass(section, Section)
    with pytest.raises(ValidationError) as refused:
        section.model_validate({"speeed": 1.0})
    assert "extra_forbidden" in {error["type"] for error in refused.value.errors()}


def test_no_two_parts_add_the_same_key():
    for of in ("rig", "mock_up", "vehicle"):
        keys = [key for part in PARTS.values() if (found := getattr(part, of)) for key in found.model_fields]
        assert len(keys) == len(set(keys)), of


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_no_number_of_a_rig_is_nan_or_infinite(value):
    given = content()
    given["mock_ups"]["standard"]["imu"]["gyro_density_rad_s_rthz"] = value
    with pytest.raises(
        RigError, match=r"overhead.toml: mock_ups.standard.imu.gyro_density_rad_s_rthz: .*finite"
    ):
        build_rig(given, RIG)


# -- controllers ----------------------------------------------------------------------------------


def with_control(place, **control):
    given = content()
    if place == "vehicles.alpha":
        given["vehicles"]["alpha"]["control"] = control
    else:
        given["mock_ups"]["standard"]["control"] = control
    return given


@pytest.mark.parametrize("place", ["mock_ups.standard", "vehicles.alpha"])
@pytest.mark.parametrize(
    ("control", "sentence"),
    [
        (
            {"controller": "hoover"},
            "{}.control: controller 'hoover' is none of dock, follow, formation, go_to, path, station, "
            "trajectory, tumble",
        ),
        (
            {"controller": "go_to", "parameters": {"speeed_m_s": 0.1}},
            "{}.control.parameters.speeed_m_s: is no parameter of this controller (a typo?)",
        ),
        (
            {"controller": "formation", "parameters": {"neighbours": {"leeder": {"offset_m": [0.5, 0.0]}}}},
            "{}.control.parameters: 'leeder' is no other vehicle of the rig (there are: beta)",
        ),
        (
            {"controller": "formation", "parameters": {"neighbours": {"alpha": {"offset_m": [0.5, 0.0]}}}},
            "{}.control.parameters: 'alpha' is no other vehicle of the rig (there are: beta)",
        ),
        ({"controler": "go_to"}, "'{}.control.controler' is no known key (a typo?)"),
    ],
    ids=["controller", "parameter", "neighbour", "itself", "key"],
)
def test_a_misspelt_controller_parameter_or_neighbour_is_refused_with_file_and_key(place, control, sentence):
    with pytest.raises(RigError) as refused:
        build_rig(with_control(place, **control), RIG)
    assert str(refused.value) == f"{RIG}: {sentence.format(place)}"


def test_a_parameter_out_of_range_is_refused_with_file_and_key():
    given = with_control("vehicles.alpha", controller="formation", parameters={"goal_weight": "much"})
    with pytest.raises(RigError) as refused:
        build_rig(given, RIG)
    assert str(refused.value).startswith(f"{RIG}: vehicles.alpha.control.parameters.")
    assert "\n" not in str(refused.value)


def test_a_vehicles_own_controller_stands_before_that_of_its_type():
    given = with_control("vehicles.alpha", controller="go_to")
    given["mock_ups"]["standard"]["control"] = {"controller": "station"}
    rig = build_rig(given, RIG)
    assert rig.tables.nodes["controller"].make(rig, "alpha")._chosen.name == "go_to"
    assert rig.tables.nodes["controller"].make(rig, "beta")._chosen.name == "station"


# -- actions --------------------------------------------------------------------------------------


def good(argument):
    """A value that an argument takes."""
    if argument.kind is float:
        low, high = max(argument.low, -1.0), min(argument.high, 1.0)
        return 0.5 * (low + high)
    return {int: 1, str: "x", bool: True}[argument.kind]


def complete(action: Action) -> dict:
    return {argument.name: good(argument) for argument in action.arguments}


def asked(action: Action, arguments: str) -> Request:
    return Request(0, "alpha", 1, "operator", action.name, arguments)


def refused_sentence(action: Action, arguments: str) -> str:
    with pytest.raises(ArgumentError) as refused:
        action.read(asked(action, arguments))
    sentence = str(refused.value)
    assert sentence.startswith(action.name)
    assert "\n" not in sentence
    return sentence


@actions
def test_the_arguments_of_an_action_survive_the_bus(action):
    given = complete(action)
    sent = codec_of(Request).encode(asked(action, json.dumps(given)))
    assert action.read(codec_of(Request).decode(sent)) == given
    assert action.check(given) == given


@actions
def test_an_argument_that_is_missing_is_named_or_has_a_default(action):
    for argument in action.arguments:
        given = complete(action)
        del given[argument.name]
        if argument.default is not None:
            assert action.read(asked(action, json.dumps(given)))[argument.name] == argument.default
        else:
            assert f"needs {argument.name}" in refused_sentence(action, json.dumps(given))


@actions
def test_an_unknown_argument_is_named(action):
    sentence = refused_sentence(action, json.dumps({**complete(action), "speeed": 1.0}))
    assert "has no argument 'speeed'" in sentence
    for argument in action.arguments:
        assert argument.name in sentence


@actions
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e999, 10**400])
def test_a_number_that_is_none_is_refused_by_its_name(action, value):
    for argument in action.arguments:
        if argument.kind is float:
            sentence = refused_sentence(action, json.dumps({**complete(action), argument.name: value}))
            assert f"{argument.name} is" in sentence
            assert "finite" in sentence


@actions
@pytest.mark.parametrize("value", ["far", None, [1.0], {"x": 1.0}, True])
def test_a_value_of_another_type_is_refused_by_its_name(action, value):
    for argument in action.arguments:
        if isinstance(value, argument.kind):
            continue
        sentence = refused_sentence(action, json.dumps({**complete(action), argument.name: value}))
        assert f"{argument.name} is {value!r}, expected" in sentence


@actions
def test_a_number_beyond_its_range_is_refused_with_the_range(action):
    for argument in action.arguments:
        for limit, beyond in ((argument.low, -1.0), (argument.high, 1.0)):
            if math.isfinite(limit):
                given = json.dumps({**complete(action), argument.name: limit + beyond})
                assert f"expected {argument.low:g} to {argument.high:g}" in refused_sentence(action, given)


@actions
@pytest.mark.parametrize("text", ["[1, 2]", "{", "null", "1.5", '"far"', "[" * 100_000])
def test_what_is_no_json_object_is_refused(action, text):
    assert "no JSON object" in refused_sentence(action, text)


@actions
def test_an_action_says_what_it_does_and_its_arguments_say_their_unit(action):
    assert action.summary
    for argument in action.arguments:
        if argument.kind is float:
            assert re.search(r"_(m|m_s|rad|rad_s|s|n|nm)$", argument.name), argument.name


def test_no_two_rows_of_the_view_stand_at_the_same_place():
    """Of equal ones the order would hang on that of the parts, and a row could part another from its rows."""
    orders = [row.order for part in TABLES.parts.values() for row in part.gauges]
    assert len(orders) == len(set(orders))
