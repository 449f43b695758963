"""The ready scenarios fly in lockstep with their verdicts; a broken limit, a wait, a vehicle are named."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from groundstation import scenario
from groundstation.cli.main import call
from groundstation.declarations.errors import UsageError
from groundstation.rig.read import load_rig
from groundstation.scenario.loading import rig_text
from groundstation.scenario.rehearsal import rehearse

EXAMPLES = Path(__file__).parents[2] / "examples"
READY = sorted((EXAMPLES / "scenarios").glob("*.toml"))
RIG = EXAMPLES / "rigs" / "two_mock_ups_drawn.toml"

SHORT = f"""
name = "short"
rig = "{RIG.as_posix()}"
duration_s = 6.0
changes = {{ "mock_ups.standard.fusion.rest_s" = 1.0 }}

[vehicles.alpha]
start = {{ x_m = -0.5, y_m = 0.0, heading_deg = 0.0 }}
[vehicles.beta]
start = {{ x_m = 0.6, y_m = 0.0, heading_deg = 90.0 }}
"""


@pytest.fixture
def file(tmp_path):
    """Writes a scenario."""

    def write(text):
        path = tmp_path / "scenario.toml"
        path.write_text(text)
        return path

    return write


@pytest.mark.slow
@pytest.mark.parametrize("path", READY, ids=[path.stem for path in READY])
def test_a_ready_scenario_passes(path):
    flown = scenario.run(scenario.load(path))
    assert flown.passed, flown.reason
    assert flown.limits


def test_two_runs_of_one_seed_are_equal_and_another_seed_is_another_run(file):
    plan = scenario.load(file(SHORT))
    first, second, other = (scenario.run(plan, seed) for seed in (3, 3, 4))
    assert first.quantities == pytest.approx(second.quantities, nan_ok=True, abs=0.0)
    assert first["alpha.estimate_error_rms_mm"] != other["alpha.estimate_error_rms_mm"]


def test_a_broken_limit_is_named_with_value_and_second_and_ends_with_1(file, tmp_path, capsys):
    limit = '[[limits]]\nwhat = "least_distance_mm"\nvehicles = ["alpha", "beta"]\nabove = 5000.0\n'
    path = file(SHORT + limit)
    record = tmp_path / "run.mcap"
    assert call(["run", str(path), "--lockstep", "--record", str(record)]) == 1
    printed = capsys.readouterr().out
    assert re.search(r"FAILED least_distance_mm of alpha-beta is \d+\.?\d* at \d\.\d s", printed)
    assert "limit above 5000" in printed
    assert "verdict: failed: least_distance_mm of alpha-beta" in printed
    assert call(["replay", str(record)]) == 0


def test_a_scenario_whose_limits_hold_ends_with_0_and_a_wrong_file_with_2(file, tmp_path, capsys):
    assert call(["run", str(file(SHORT)), "--lockstep", "--record", str(tmp_path / "run.mcap")]) == 0
    assert "verdict: passed" in capsys.readouterr().out
    path = file(SHORT.replace("duration_s", "durations"))
    assert call(["run", str(path), "--lockstep", "--record", str(tmp_path / "no.mcap")]) == 2
    assert not (tmp_path / "no.mcap").exists()
    assert "'durations' is no known key" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["--duration", "5"], ["--hardware", "x.toml", "--lockstep"],
                                   ["--hardware", str(RIG), "--i-know", " "],
                                   ["--lockstep", "--i-know", "why"]])  # fmt: skip
def test_options_that_do_not_go_together_are_refused(file, words, capsys):
    assert call(["run", str(file(SHORT)), *words]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_who_ends_a_run_by_hand_gets_no_verdict(file, tmp_path):
    path = file(SHORT.replace("duration_s = 6.0", "duration_s = 3600.0"))
    record = tmp_path / "run.mcap"
    words = [sys.executable, "-m", "groundstation", "run", str(path), "--lockstep", "--record", str(record)]
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as run:
        part = record.with_name("run.mcap.part")
        while run.poll() is None and not (part.exists() and part.stat().st_size > 50_000):
            os.sched_yield()
        run.send_signal(signal.SIGINT)
        _, said = run.communicate(timeout=60)
    assert run.returncode == 3, said
    assert said == "groundstation: ended by hand, so there is no verdict\n"
    assert record.exists()  # what was flown can be looked at


def test_a_vehicle_that_comes_down_fails_the_run_unless_it_may_land(file):
    lands = '\n[[timeline]]\nat_s = 2.0\nvehicle = "beta"\nrequest = "land"\n'
    flown = scenario.run(scenario.load(file(SHORT + lands)))
    assert not flown.passed
    assert flown.reason.startswith("beta ended landed since 2.")
    text = (SHORT + lands).replace("heading_deg = 90.0 }", "heading_deg = 90.0 }\nmay_land = true")
    assert scenario.run(scenario.load(file(text))).passed


def test_who_is_sent_through_an_obstacle_stops_before_it(file):
    """The straight way leads through it: the safety filter keeps out, and finds no way around."""
    way = """
[[obstacles]]
x_m = 0.0
y_m = 0.6
radius_m = 0.1
[[timeline]]
at_s = 1.0
vehicle = "alpha"
request = "go_to"
arguments = { x_m = 0.6, y_m = 1.2, heading_deg = 0.0 }
[[limits]]
what = "least_obstacle_mm"
vehicle = "alpha"
above = 5.0
"""
    flown = scenario.run(scenario.load(file(SHORT.replace("duration_s = 6.0", "duration_s = 30.0") + way)))
    assert flown.passed, flown.reason
    assert flown["alpha.least_obstacle_mm"] < 100.0  # it came near
    assert flown["alpha.contacts"] == 0


def test_another_answer_than_expected_fails_the_run_with_the_reason(file):
    row = (
        '\n[[timeline]]\nat_s = 1.0\nvehicle = "alpha"\nrequest = "go_to"\n'
        "arguments = { x_m = 0.5, y_m = 0.0, heading_deg = 0.0 }\n"
    )
    flown = scenario.run(scenario.load(file(SHORT + row)))
    assert "timeline.0: alpha's go_to was refused, expected accepted: beta is 0.10 m" in flown.reason
    assert scenario.run(scenario.load(file(SHORT + row + 'answer = "refused"\n'))).passed


def test_vehicles_hold_their_starts_until_all_fly_and_programs_begin_then(file):
    control = (
        '\ncontrol = { controller = "path", parameters = { waypoints_m = [[0.0, 0.8]], speed_m_s = 0.1 } }\n'
    )
    text = SHORT.replace("heading_deg = 0.0 }", "heading_deg = 0.0 }" + control)
    flown = scenario.run(scenario.load(file(text)))
    assert flown.passed, flown.reason
    t_s, x_m, y_m, *_ = flown.truth("alpha")
    before = t_s <= 0.0
    assert abs(x_m[before] + 0.5).max() < 0.01
    assert abs(y_m[before]).max() < 0.01
    assert y_m[-1] > 0.1
    words = [event.text for event in flown.events if event.kind == "request"]
    assert words == ["resume accepted"]


def test_a_program_is_interrupted_by_a_goal_and_goes_on_when_resumed(file):
    text = SHORT.replace("duration_s = 6.0", "duration_s = 24.0").replace(
        "heading_deg = 0.0 }",
        'heading_deg = 0.0 }\ncontrol = { controller = "path", parameters = '
        "{ waypoints_m = [[-0.5, 1.0]], speed_m_s = 0.1 } }",
    )
    rows = (
        '\n[[timeline]]\nat_s = 1.0\nvehicle = "alpha"\nrequest = "go_to"\n'
        "arguments = { x_m = -0.8, y_m = 0.0, heading_deg = 0.0 }\n"
        '[[timeline]]\nwhen = "alpha.settled"\ntimeout_s = 15.0\nvehicle = "alpha"\nrequest = "resume"\n'
    )
    flown = scenario.run(scenario.load(file(text + rows)))
    assert flown.passed, flown.reason
    _, x_m, y_m, *_ = flown.truth("alpha")
    assert x_m.min() == pytest.approx(-0.8, abs=0.02)
    assert y_m[-1] > 0.1


def test_a_law_of_the_caller_flies_in_the_place_of_the_rigs(file):
    def push(state, goal, dt_s):
        del state, goal, dt_s
        return 0.1, 0.0, 0.0

    flown = scenario.run(scenario.load(file(SHORT)), laws={"alpha": push})
    _, x_m, *_ = flown.truth("alpha")
    assert x_m[-1] > -0.5 + 0.05


def test_results_are_arrays_and_with_the_extra_data_frames(file):
    pandas = pytest.importorskip(
        "pandas", reason="pandas is not installed: pip install groundstation[notebook]"
    )
    limit = '[[limits]]\nwhat = "position_error_max_mm"\nvehicle = "all"\nfrom_s = 1.0\nbelow = 500.0\n'
    flown = scenario.run(scenario.load(file(SHORT + limit)))
    truth = flown.frame("alpha")
    assert isinstance(truth, pandas.DataFrame)
    assert list(truth.columns) == ["t_s", "x_m", "y_m", "heading_rad", "vx_m_s", "vy_m_s"]
    assert (flown.truth("alpha") == truth.to_numpy().T).all()
    assert truth.set_index("t_s").x_m.loc[1.0:].between(-0.6, -0.4).all()
    limits = flown.limits_frame()
    assert list(limits.vehicles) == ["alpha", "beta"]
    assert limits.held.all()
    assert (limits.value < limits.below).all()
    assert list(limits.value) == [limit.value for limit in flown.limits]
    with pytest.raises(KeyError, match="no vehicle 'gamma'"):
        flown.frame("gamma")


def test_without_pandas_the_extra_is_named(file, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)  # as where it is not installed
    flown = scenario.run(scenario.load(file(SHORT)).vary({"duration_s": 0.5}))
    with pytest.raises(UsageError, match=r"pip install 'groundstation\[notebook\]'"):
        flown.frame("alpha")
    assert flown.truth("alpha").shape[0] == 6


def hardware(tmp_path, twin):
    """A rig of real devices that names its twin."""
    text = RIG.read_text().split("[laboratory]")[0].replace("laboratory:", "/dev/nowhere_")
    text = text.replace(
        'valve_bus = "/dev/nowhere_valve_bus"', 'valve_bus = { interface = "socketcan", channel = "can9" }'
    )
    path = tmp_path / "hardware.toml"
    path.write_text(text if twin is None else f'twin = "{twin}"\n{text}')
    return path


def test_a_notebooks_mistakes_are_named(file):
    plan = scenario.load(file(SHORT)).vary({"duration_s": 0.5})
    with pytest.raises(UsageError, match="no vehicle 'gamma'"):
        scenario.run(plan, laws={"gamma": lambda state, goal, dt_s: (0.0, 0.0, 0.0)})
    with pytest.raises(UsageError, match=r"laws: alpha: expected a controller or a function .*found 'go_to'"):
        scenario.run(plan, laws={"alpha": "go_to"})
    with pytest.raises(TypeError, match=r"takes what scenario\.load returns, found 'short\.toml'"):
        scenario.run("short.toml")
    with pytest.raises(UsageError, match="3: a key is a text"):
        plan.vary({3: 4.0})
    for seed in (-1, 1.5, "x", True):
        with pytest.raises(UsageError, match=f"seed: expected a whole number from 0 up, found {seed!r}"):
            scenario.run(plan, seed)
    flown = scenario.run(plan)
    assert repr(flown) == "<short: passed>"
    with pytest.raises(KeyError, match=r"'alpha.gas' .*alpha\.gas_ns"):
        flown["alpha.gas"]
    with pytest.raises(KeyError, match=r"no vehicle 'gamma' .*alpha, beta"):
        flown.truth("gamma")
    grounded = scenario.run(plan.vary({"ready_s": 0.01}))
    with pytest.raises(KeyError, match="nothing was flown: ready_s"):
        grounded["alpha.gas_ns"]


def test_limits_of_groups_and_pairs_are_judged_for_each(file):
    limits = (
        '[[limits]]\nwhat = "gas_ns"\nvehicles = ["alpha", "beta"]\nbelow = 1000.0\n'
        '[[limits]]\nwhat = "least_distance_mm"\nvehicle = "all"\nabove = 10.0\n'
    )
    flown = scenario.run(scenario.load(file(SHORT + limits)).vary({"duration_s": 0.5}))
    assert flown.passed
    assert [limit.vehicles for limit in flown.limits] == [("alpha",), ("beta",), ("alpha", "beta")]


def test_hardware_without_a_twin_is_refused(file, tmp_path):
    with pytest.raises(UsageError, match="names no emulated twin"):
        rehearse(scenario.load(file(SHORT)), load_rig(hardware(tmp_path, None)))


def test_the_refusal_names_the_rig_without_a_twin(file, tmp_path, capsys):
    rig = hardware(tmp_path, None)
    assert call(["run", str(file(SHORT)), "--hardware", str(rig)]) == 2
    assert f"{rig}: the rig names no emulated twin" in capsys.readouterr().err


def test_the_dry_run_lets_pass_what_goes_well_on_the_twin(file, tmp_path):
    plan = scenario.load(file(SHORT))
    rig = load_rig(hardware(tmp_path, RIG.as_posix()))
    assert rehearse(plan, rig) == ""
    section = plan.on_hardware(rig).section
    assert section.settle_first
    assert "x_m = -0.5" in rig_text(plan.on_hardware(rig).rig)


def test_the_dry_run_refuses_a_contact_with_time_and_place(file, tmp_path):
    push = (
        '\n[[timeline]]\nat_s = 1.0\nvehicle = "alpha"\nfailure = "pushed"\n'
        "parameters = { force_x_n = 90.0 }\nfor_s = 0.5\n"
    )
    refusal = rehearse(scenario.load(file(SHORT + push)), load_rig(hardware(tmp_path, RIG.as_posix())))
    assert refusal.startswith("the dry run: ")
    assert "touches something at " in refusal
    assert refusal.endswith(") m")


def test_failures_cannot_be_injected_into_hardware(file, tmp_path, capsys):
    push = '\n[[timeline]]\nat_s = 1.0\nvehicle = "alpha"\nfailure = "dead_sky"\nfor_s = 0.5\n'
    path = file(SHORT + push)
    assert call(["run", str(path), "--hardware", str(hardware(tmp_path, RIG.as_posix()))]) == 2
    assert "timeline.0.failure" in capsys.readouterr().err


def test_a_twin_with_other_calibration_or_vehicles_is_none(file, tmp_path):
    plan = scenario.load(file(SHORT))
    other = EXAMPLES / "rigs" / "drawn_fixes.toml"
    with pytest.raises(UsageError, match="has other vehicles"):
        rehearse(plan, load_rig(hardware(tmp_path, other.as_posix())))
    larger = tmp_path / "larger.toml"
    text = RIG.read_text()
    larger.write_text(text.replace("x_max_m = 2.0", "x_max_m = 3.0").replace("[-2.0, 2.0", "[-2.0, 3.0"))
    with pytest.raises(UsageError, match=r"\[table\] of .*larger\.toml is not that of the rig"):
        rehearse(plan, load_rig(hardware(tmp_path, larger.as_posix())))
