"""Whatever is wrong with a scenario file is one sentence with file and key, before anything moves."""

import re
from pathlib import Path

import pytest

from groundstation.declarations.errors import UsageError
from groundstation.scenario.loading import load
from groundstation.scenario.rehearsal import check_dispersions, check_extremes, check_failures

RIG = Path(__file__).parents[4] / "examples/rigs/two_mock_ups_drawn.toml"
GOOD = f"""
name = "test"
rig = "{RIG.as_posix()}"
duration_s = 60.0

[vehicles.alpha]
start = {{ x_m = -1.0, y_m = -0.8, heading_deg = 0.0 }}
control = {{ controller = "path", parameters = {{ waypoints_m = [[1.0, -0.8], [1.0, 0.8]], closed = true }} }}

[vehicles.beta]
start = {{ x_m = -1.0, y_m = 0.2, heading_deg = -90.0 }}
control = {{ controller = "follow", parameters = {{ leader = "alpha", distance_m = 0.8 }} }}

[[obstacles]]
x_m = 0.3
y_m = 0.0
radius_m = 0.15

[[timeline]]
at_s = 20.0
vehicle = "beta"
request = "go_to"
arguments = {{ x_m = 0.2, y_m = 0.6, heading_deg = 90.0 }}

[[timeline]]
at_s = 30.0
vehicle = "alpha"
failure = "stuck_open_valve"
parameters = {{ valve = 3 }}
for_s = 5.0

[[timeline]]
when = "beta.settled"
timeout_s = 20.0
mark = "there"

[[limits]]
what = "least_distance_mm"
vehicles = ["alpha", "beta"]
above = 100.0

[[limits]]
what = "distance_error_rms_mm"
vehicle = "followers"
from_s = 40.0
below = 50.0

[dispersions]
"laboratory.alpha.mass_kg" = {{ normal = [11.0, 0.2] }}
"""

MISTAKES = {
    "unknown key": ('duration_s = 60.0', 'durations = 60.0', ["'durations' is no known key"]),
    "no rig file": (RIG.as_posix(), "nowhere.toml", ["nowhere.toml"]),
    "negative duration": ("duration_s = 60.0", "duration_s = -1.0", ["duration_s"]),
    "unknown vehicle": ("[vehicles.beta]", "[vehicles.gamma]", ["vehicles.gamma", "alpha, beta"]),
    "unknown controller": ('"path"', '"paht"', ["vehicles.alpha.control", "'paht'", "path"]),
    "unknown parameter": ("closed = true", "close = true", ["vehicles.alpha.control.parameters", "close"]),
    "leader that is not there": (
        'leader = "alpha"', 'leader = "gamma"', ["vehicles.beta.control", "'gamma'"],
    ),
    "leader that follows itself": ('leader = "alpha"', 'leader = "beta"', ["vehicles.beta.control", "beta"]),
    "too near a leader": ("distance_m = 0.8", "distance_m = 0.3", ["vehicles.beta.control", "distance_m"]),
    "waypoint off the table": ("[1.0, 0.8]]", "[1.0, 1.8]]", ["vehicles.alpha.control", "1.8"]),
    "start off the table": ("x_m = -1.0, y_m = -0.8", "x_m = -3.0, y_m = -0.8", ["vehicles.alpha.start"]),
    "two at one place": ("y_m = 0.2, heading_deg = -90.0", "y_m = -0.7, heading_deg = 0.0",
                         ["vehicles.beta.start", "alpha", "0.10 m"]),
    "start on an obstacle": ("x_m = -1.0, y_m = 0.2", "x_m = 0.4, y_m = 0.2",
                             ["vehicles.beta.start", "obstacle"]),
    "obstacle off the table": ("x_m = 0.3\ny_m = 0.0", "x_m = 3.3\ny_m = 0.0", ["obstacles.0", "3.3"]),
    "unknown action": ('"go_to"', '"goto"', ["timeline.0.request", "'goto'", "go_to"]),
    "unknown argument": ("x_m = 0.2, y_m = 0.6", "x = 0.2, y_m = 0.6", ["timeline.0.arguments", "x_m"]),
    "missing argument": ("y_m = 0.6, heading_deg", "heading_deg", ["timeline.0.arguments", "y_m"]),
    "argument that is a text": ("x_m = 0.2", 'x_m = "left"', ["timeline.0.arguments", "x_m"]),
    "goal off the table": ("x_m = 0.2, y_m = 0.6", "x_m = 5.0, y_m = 0.6", ["timeline.0.arguments", "(5, "]),
    "goal on an obstacle": ("x_m = 0.2, y_m = 0.6", "x_m = 0.2, y_m = 0.1", ["timeline.0", "obstacle"]),
    "request of nobody": ('vehicle = "beta"\nrequest', 'request', ["timeline.0", "'vehicle'"]),
    "two things at once": ('request = "go_to"', 'request = "go_to"\nmark = "x"', ["timeline.0", "one of"]),
    "no moment": ("at_s = 20.0\n", "", ["timeline.0", "'at_s' or 'when'"]),
    "behind the end": ("at_s = 20.0", "at_s = 61.0", ["timeline.0.at_s", "duration_s"]),
    "unknown failure": ('"stuck_open_valve"', '"gremlin"', ["timeline.1", "gremlin"]),
    "unknown parameter of a failure": ("{ valve = 3 }", "{ valv = 3 }", ["timeline.1", "valv"]),
    "impossible parameter of a failure": ("{ valve = 3 }", "{ valve = 9 }", ["timeline.1", "valve"]),
    "failure without an end": ("for_s = 5.0\n", "", ["timeline.1", "for_s"]),
    "wait for nobody": ('"beta.settled"', '"gamma.settled"', ["timeline.2.when", "gamma"]),
    "wait for nothing that is": ('"beta.settled"', '"beta.happy"', ["timeline.2.when", "happy"]),
    "wait that can never come true": (
        '"beta.settled"', '"distance_mm(alpha,beta) < -5"', ["timeline.2.when", "never"],
    ),
    "wait beyond the table": (
        '"beta.settled"', '"distance_mm(alpha,beta) > 9000"', ["timeline.2.when", "never"],
    ),
    "wait for a distance to itself": (
        '"beta.settled"', '"distance_mm(beta,beta) < 500"', ["timeline.2.when", "two different"],
    ),
    "wait too short to settle": ("timeout_s = 20.0", "timeout_s = 2.0", ["timeline.2.timeout_s", "3 s"]),
    "wait behind the end": ("timeout_s = 20.0", "timeout_s = 20.0\nafter_s = 50.0", ["timeline.2", "end"]),
    "wait without an end": ("timeout_s = 20.0\n", "", ["timeline.2", "timeout_s"]),
    "limit without unit": ('"least_distance_mm"', '"least_distance"', ["limits.0", "least_distance_mm"]),
    "unknown limit": ('"least_distance_mm"', '"beauty_mm"', ["limits.0", "beauty_mm"]),
    "limit without a bound": ("above = 100.0", "", ["limits.0", "below"]),
    "limit of nobody": ('vehicle = "followers"', 'vehicle = "gamma"', ["limits.1.vehicle", "gamma"]),
    "limit of one that needs two": ('["alpha", "beta"]', '["alpha"]', ["limits.0", "two vehicles"]),
    "limit over no span": ("from_s = 40.0", "from_s = 40.0\nto_s = 30.0", ["limits.1", "from_s"]),
    "limit behind the end": ("from_s = 40.0", "from_s = 70.0", ["limits.1", "duration_s"]),
    "rig of an impossible name": (RIG.as_posix(), "a\\u0000b", ["cannot be read"]),
    "nothing marked": ('mark = "there"', 'mark = " "', ["timeline.2.mark", "words"]),
    "mark that moves the cursor": ('mark = "there"', 'mark = "\\u001b[2J"', ["timeline.2.mark", "control"]),
    "mark without an end": ('mark = "there"', f'mark = "{"x" * 5000}"', ["timeline.2.mark", "200"]),
    "name of two lines": ('name = "test"', 'name = "a\\nb"', ["name", "one line"]),
    "mark of nobody": ('mark = "there"', 'mark = "there"\nvehicle = "gamma"',
                              ["timeline.2.vehicle", "gamma"]),
    "heading that is a text": ("heading_deg = 90.0", 'heading_deg = "east"',
                               ["timeline.0.arguments", "heading_deg", "a number"]),
    "heading in radians": ("heading_deg = 90.0", "heading_rad = 1.5",
                              ["timeline.0.arguments", "heading_deg"]),
    "wait for two modes": ('"beta.settled"', '"beta.flying and beta.landed"',
                              ["timeline.2.when", "same time"]),
    "wait for two distances": (
        '"beta.settled"', '"distance_mm(alpha,beta) < 100 and distance_mm(beta,alpha) > 200"',
        ["timeline.2.when", "above 200 and below 100"],
    ),
    "wait for more room than there is": ('"beta.settled"', '"edge_mm(beta) > 1400"',
                              ["timeline.2.when", "never"]),
    "wait for a speed that nothing has": ('"beta.settled"', '"speed_mm_s(beta) > 1e9"',
                              ["timeline.2.when", "never"]),
    "dispersion that is drawn twice": (
        "{ normal = [11.0, 0.2] }",
        '{ normal = [11.0, 0.2] }\n"laboratory.*.mass_kg" = { uniform = [10.0, 12.0] }',
        ["dispersions.laboratory.*.mass_kg", "already"],
    ),
    "one value of two laws": (
        "{ normal = [11.0, 0.2] }",
        '{ normal = [11.0, 0.2], common = "m" }\n'
        '"laboratory.beta.mass_kg" = { uniform = [10.0, 12.0], common = "m" }',
        ["dispersions.laboratory.beta.mass_kg", "common"],
    ),
    "dispersion of the seed": ('"laboratory.alpha.mass_kg"', '"laboratory.seed"',
                              ["dispersions.laboratory.seed"]),
    "limit of no vehicles": ('["alpha", "beta"]', "[]", ["limits.0.vehicles"]),
    "limit of a pair of one": ('vehicles = ["alpha", "beta"]', 'vehicle = "followers"',
                               ["limits.0", "two vehicles", "beta"]),
    "limit of what the vehicle has not": ('vehicle = "followers"', 'vehicle = "alpha"',
                                          ["limits.1", "alpha", "distance_error_rms_mm"]),
    "limit that never holds": ("below = 50.0", "below = 0.0", ["limits.1", "below", "never"]),
    "limits that contradict each other": ("below = 50.0", "below = 50.0\nabove = 60.0", ["limits.1", "both"]),
    "dispersion of a row that is no number": (
        '"laboratory.alpha.mass_kg"', '"timeline.\u00b2.at_s"', ["timeline.\u00b2"],
    ),
    "dispersion of nothing": ('"laboratory.alpha.mass_kg"', '"laboratory.alpha.mas_kg"',
                              ["laboratory.alpha.mas_kg"]),
    "dispersion of no vehicle": ('"laboratory.alpha.mass_kg"', '"vehicles.gamma.start.x_m"', ["gamma"]),
    "dispersion of no table": ('"laboratory.alpha.mass_kg"', '"mock_ups.stand.mass_kg"', ["mock_ups.stand"]),
    "dispersion without a law": ("{ normal = [11.0, 0.2] }", "{ }", ["dispersions", "one of"]),
    "dispersion of a list that is not written": (
        '"laboratory.alpha.mass_kg"', '"laboratory.alpha.thrusters.0.thrust_n"',
        ["dispersions.laboratory.alpha.thrusters.0.thrust_n", "writes no such list"],
    ),
    "dispersion behind the end of a list": (
        '"laboratory.alpha.mass_kg"', '"laboratory.table.tilt_rad.2"',
        ["dispersions.laboratory.table.tilt_rad.2", "a list of 2"],
    ),
    "dispersion of a place by a second spelling": (
        '"laboratory.alpha.mass_kg"', '"laboratory.vehicles.0.mass_kg"', ["laboratory.vehicles"],
    ),
    "dispersion of a place of very many digits": (
        '"laboratory.alpha.mass_kg"', f'"timeline.{"1" * 5000}.at_s"', ["dispersions.timeline.1111"],
    ),
    "dispersion of what a start stands in place of": (
        '"laboratory.alpha.mass_kg" = { normal = [11.0, 0.2] }',
        '"laboratory.alpha.start_heading_deg" = { normal = [0.0, 2.0] }',
        ["dispersions.laboratory.alpha.start_heading_deg: vehicles.alpha.start stands in its place"],
    ),
    "two spellings of one dispersion": (
        '{ normal = [11.0, 0.2] }',
        '{ normal = [11.0, 0.2] }\n"vehicles.alpha.laboratory.mass_kg" = { normal = [11.0, 0.2] }',
        ["dispersions: laboratory.alpha.mass_kg", "vehicles.alpha.laboratory.mass_kg stands in its place"],
    ),
    "key of the laboratory": (
        "[vehicles.alpha]", '[vehicles.alpha]\nlaboratory = { mass_kg = "heavy" }',
        [": vehicles.alpha.laboratory.mass_kg: ", "found 'heavy'"],
    ),
    "all sent to one place": ('vehicle = "beta"', 'vehicle = "all"',
                              ["timeline.0", "alpha and beta", "one place"]),
    "no list": ('vehicles = ["alpha", "beta"]', 'vehicles = "all"', ["limits.0.vehicles: expected a list"]),
    "rig without a name": (RIG.as_posix(), "", [": rig: "]),
    "rig of a very long name": (RIG.as_posix(), "a" * 5000, [": rig: ", "aaa... cannot be read"]),
    "rig that is the scenario": (RIG.as_posix(), "wrong.toml", [": rig: ", "is a scenario; expected a rig"]),
    "nothing to add to": ("{ normal = [11.0, 0.2] }", "{ add_normal = [11.0, 0.2] }",
                          ["dispersions.laboratory.alpha.mass_kg", "add"]),
}  # fmt: skip


def complete_check(path: Path) -> None:
    """What a run and a campaign check before they fly."""
    scenario = load(path)
    check_failures(scenario)
    check_dispersions(scenario)


def test_the_scenario_that_the_mistakes_are_made_in_is_right(tmp_path: Path) -> None:
    path = tmp_path / "good.toml"
    path.write_text(GOOD)
    complete_check(path)


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_one_sentence_with_file_and_key(mistake: str, tmp_path: Path) -> None:
    old, new, words = MISTAKES[mistake]
    assert old in GOOD, "the mistake changes nothing"
    path = tmp_path / "wrong.toml"
    path.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(UsageError) as caught:
        complete_check(path)
    sentence = str(caught.value)
    for word in words:
        assert word in sentence, sentence
    assert "wrong.toml" in sentence, sentence
    assert "\n" not in sentence
    assert len(sentence) < 1500


@pytest.mark.parametrize(
    ("law", "value"),
    [("{ choice = [11.0, 11.5, -1.0] }", "-1.0"), ('{ choice = [11.0, "heavy"] }', "'heavy'"),
     ("{ uniform = [-0.001, 1000.0] }", "-0.001")],
)  # fmt: skip
def test_what_a_campaign_may_draw_is_tried_before_it_flies(law, value, tmp_path):
    path = tmp_path / "scenario.toml"
    path.write_text(GOOD.replace("{ normal = [11.0, 0.2] }", law))
    with pytest.raises(UsageError, match=re.escape(f"dispersions.laboratory.alpha.mass_kg: {value}: ")):
        check_extremes(load(path))


def test_a_mistake_in_the_laboratory_of_a_rig_is_that_of_its_file(tmp_path):
    rig, path = tmp_path / "rig.toml", tmp_path / "scenario.toml"
    rig.write_text(RIG.read_text().replace("tilt_rad = [0.0003, -0.0001]", "tilt_rad = 0.0003"))
    path.write_text(GOOD.replace(RIG.as_posix(), rig.name))
    with pytest.raises(UsageError, match=re.escape(f"{rig}: laboratory.table.tilt_rad: expected a list")):
        check_failures(load(path))


def test_a_rig_is_no_scenario():
    with pytest.raises(UsageError, match="is a rig; a scenario file names"):
        load(RIG)


def test_a_goal_off_the_table_may_be_expected_to_be_refused(tmp_path: Path) -> None:
    path = tmp_path / "refused.toml"
    text = GOOD.replace("x_m = 0.2, y_m = 0.6", "x_m = 5.0, y_m = 0.6")
    path.write_text(text.replace('request = "go_to"', 'request = "go_to"\nanswer = "refused"'))
    complete_check(path)
