"""Records that are made quickly are what their dataclass makes of them."""

from dataclasses import FrozenInstanceError, dataclass, field

import pytest

from drivers.quick_record import quickly_made


@quickly_made
@dataclass(frozen=True, slots=True)
class Plain:
    first: int
    second: str = "two"

    def __post_init__(self) -> None:
        if self.first < 0:
            raise ValueError("first is negative")


@quickly_made
@dataclass(frozen=True, slots=True)
class WithList:
    rows: list[int] = field(default_factory=list)


def test_fields_and_defaults_are_those_of_the_dataclass():
    assert Plain(1) == Plain(first=1, second="two")
    assert repr(Plain(3, "x")) == "Plain(first=3, second='x')"
    assert hash(Plain(1)) == hash(Plain(1, "two"))


def test_it_stays_frozen_and_checks_itself():
    with pytest.raises(FrozenInstanceError):
        Plain(1).first = 2
    with pytest.raises(ValueError, match="negative"):
        Plain(-1)


def test_wrong_arguments_are_refused_by_name():
    with pytest.raises(TypeError, match="missing 1 required positional argument"):
        Plain()


def test_a_factory_makes_a_new_list_for_each():
    assert WithList().rows is not WithList().rows
