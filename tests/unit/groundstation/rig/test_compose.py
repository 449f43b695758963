"""The rig's model is composed of the parts' keys: each key has one owner."""

import pytest

from groundstation.declarations.errors import UsageError
from groundstation.declarations.part import Part
from groundstation.declarations.section import Section
from groundstation.declarations.tables import Tables
from groundstation.rig.compose import rig_model


class Colour(Section):
    colour: str = "red"


class OtherColour(Section):
    colour: int = 3


class Mass(Section):
    mass_kg: float = 1.0


def test_keys_of_parts_stand_beside_those_of_the_rig():
    model = rig_model(Tables([Part("paint", "", rig=Colour), Part("load", "", vehicle=Mass)]))
    assert {"name", "table", "colour"} <= set(model.model_fields)


@pytest.mark.parametrize(
    ("one", "two", "complaint"),
    [
        (
            {"vehicle": Colour},
            {"vehicle": OtherColour},
            "'two' adds a key 'colour' to a vehicle, .* part 'one'",
        ),
        ({"rig": Colour}, {"rig": OtherColour}, "'two' adds a key 'colour' to the rig, .* by the part 'one'"),
        ({}, {"mock_up": Mass}, "'two' adds a key 'mass_kg' to a type of mock-up, .* by the rig itself"),
    ],
)
def test_a_key_that_is_taken_is_refused_with_its_owner(one, two, complaint):
    with pytest.raises(UsageError, match=complaint):
        rig_model(Tables([Part("one", "", **one), Part("two", "", **two)]))
