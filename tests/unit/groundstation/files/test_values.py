import math

import pytest

from groundstation.files.values import number, numbers, whole_number


@pytest.mark.parametrize("value", [None, "1", True, math.nan, math.inf, [1.0]])
def test_what_is_no_finite_number_is_refused_by_its_key(value):
    with pytest.raises(ValueError, match=r"key 'a' must be a finite number, found "):
        number({"a": value}, "a")
    with pytest.raises(ValueError, match=r"key 'a' must be a list of 2 finite numbers, found "):
        numbers({"a": [1.0, value]}, "a", 2)


def test_what_is_missing_is_refused_by_the_name_that_people_know():
    with pytest.raises(ValueError, match=r"^alpha\.radius_m is missing$"):
        number({}, "radius_m", "alpha.radius_m")
    with pytest.raises(ValueError, match=r"^key 'a' is missing$"):
        numbers({}, "a", 2)


def test_numbers_come_as_floats_and_sides_as_integers():
    assert number({"a": 3}, "a") == 3.0
    assert numbers({"a": [1, 2.5]}, "a", 2) == (1.0, 2.5)
    assert whole_number({"a": 640.0}, "a") == 640
    for value in ([1], [1, 2, 3], 1, "12"):
        with pytest.raises(ValueError, match="a list of 2"):
            numbers({"a": value}, "a", 2)
    with pytest.raises(ValueError, match=r"whole number, found 640\.5"):
        whole_number({"a": 640.5}, "a")
