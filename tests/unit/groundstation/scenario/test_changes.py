"""A change of the rig's keys changes what flies, or is refused: none is read and then forgotten."""

import pytest

from groundstation.declarations.errors import UsageError
from groundstation.parts.control.sections import control_of
from groundstation.scenario.loading import load
from tests.unit.groundstation.scenario.test_mistakes import RIG

BARE = f'name = "bare"\nrig = "{RIG.as_posix()}"\nduration_s = 5.0\n'
PATH = '{ controller = "path", parameters = { waypoints_m = [[0.5, 0.5], [0.0, 0.0]], speed_m_s = 0.06 } }'


@pytest.fixture
def loaded(tmp_path):
    """Reads a scenario of these lines."""

    def read(lines):
        path = tmp_path / "scenario.toml"
        path.write_text(BARE + lines)
        return load(path)

    return read


@pytest.mark.parametrize(
    "line",
    [
        '"mock_ups.standard.control" = { controller = "station" }',
        '"mock_ups.standard.control.controller" = "station"',
        '"vehicles.alpha.control" = { controller = "station" }',
        '"vehicles.alpha.control.controller" = "station"',
    ],
)
def test_a_change_of_the_controller_flies(loaded, line):
    section = control_of(loaded(f"[changes]\n{line}\n").rig, "alpha")[0]
    assert section.controller == "station"
    assert section.waits


def test_a_parameter_that_is_dispersed_reaches_the_controller(loaded):
    key = "mock_ups.standard.control.parameters.speed_m_s"
    plan = loaded(f'[changes]\n"mock_ups.standard.control" = {PATH}\n')
    assert control_of(plan.vary({key: 0.03}).rig, "beta")[0].parameters["speed_m_s"] == 0.03


def test_a_parameter_of_the_rigs_controller_is_varied_by_the_name_of_its_vehicle(loaded):
    plan = loaded(f'[changes]\n"mock_ups.standard.control" = {PATH}\n')
    varied = plan.vary({"vehicles.beta.control.parameters.speed_m_s": 0.02})
    assert control_of(varied.rig, "beta")[0].parameters["speed_m_s"] == 0.02
    assert control_of(varied.rig, "alpha")[0].parameters["speed_m_s"] == 0.06


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ('"mock_ups.standard.control.parameters.kp" = 3.0', "parameters.kp: is no parameter"),
        ("mock_ups.standard.mass_kg = 12.0", '"mock_ups.standard.mass_kg"'),
        ('"vehicles.alpha.hold.x_m" = 0.1', "vehicles.alpha.start stands in its place"),
        ('"laboratory.alpha.mass_kg" = 12.0', "vehicles.alpha.laboratory.mass_kg stands in its place"),
        ('"laboratory.alpha.start_m" = [0.0, 0.0]', "vehicles.alpha.start stands in its place"),
        ('"table.keep_out" = []', "obstacles stands in its place"),
        (
            '"vehicles.beta.hold.x_m" = 0.1\n"vehicles.beta.hold" = { x_m = 0.2, y_m = 0.0 }',
            "vehicles.beta.hold.x_m: vehicles.beta.hold below it stands in its place",
        ),
        ('"vehicles.beta.control.controller" = "path"', "vehicles.beta.control stands in its place"),
    ],
)
def test_a_change_that_would_change_nothing_is_refused(loaded, lines, words):
    own = (
        "[vehicles.alpha]\nstart = { x_m = -0.5, y_m = 0.0, heading_deg = 0.0 }\n"
        "laboratory = { mass_kg = 11.5 }\n[[obstacles]]\nx_m = 0.0\ny_m = 1.0\nradius_m = 0.1\n"
        '[vehicles.beta]\ncontrol = { controller = "go_to" }\n'
    )
    with pytest.raises(UsageError) as caught:
        loaded(f"{own}[changes]\n{lines}\n")
    assert words in str(caught.value)


def test_a_types_controller_that_flies_nobody_is_not_changed(loaded):
    own = "".join(f'[vehicles.{name}]\ncontrol = {{ controller = "go_to" }}\n' for name in ("alpha", "beta"))
    with pytest.raises(UsageError, match="a controller of its own"):
        loaded(f'{own}[changes]\n"mock_ups.standard.control.controller" = "station"\n')
