"""Advice on the legs of the table."""

import numpy as np
import pytest

from groundstation.fusion.levelling import levelling
from groundstation.fusion.table_map import G_M_S2

LEGS = {"A": (-1.8, -1.3), "B": (1.8, -1.3), "C": (1.8, 1.3), "D": (-1.8, 1.3)}
SURE = np.eye(2) * (1e-5) ** 2


def test_the_leg_where_vehicles_glide_to_is_raised():
    """A vehicle that is pulled along +x has found the low end there: 0.1 mrad over 3.6 m are 0.36 mm."""
    advice = {leg.name: leg for leg in levelling((1e-4 * G_M_S2, 0.0), SURE, LEGS).legs}
    assert advice["B"].raise_m == pytest.approx(0.36e-3)
    assert advice["C"].raise_m == pytest.approx(0.36e-3)
    assert advice["A"].raise_m == advice["D"].raise_m == 0.0


def test_raising_the_legs_as_advised_levels_the_table():
    mean = np.array([2.3e-3, -1.1e-3])
    advice = levelling((2.3e-3, -1.1e-3), SURE, LEGS)
    places = np.array([[*LEGS[leg.name], 1.0] for leg in advice.legs])
    plane, *_ = np.linalg.lstsq(places, np.array([leg.raise_m for leg in advice.legs]), rcond=None)
    assert mean - G_M_S2 * plane[:2] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_no_leg_is_ever_lowered():
    rng = np.random.default_rng(1)
    for mean in rng.normal(0.0, 3e-3, (20, 2)):
        legs = levelling((mean[0], mean[1]), SURE, LEGS).legs
        assert min(leg.raise_m for leg in legs) == 0.0


def test_a_table_within_its_noise_is_called_level():
    advice = levelling((1e-5, 1e-5), np.eye(2) * (2e-5) ** 2, LEGS)
    assert advice.is_level
    assert advice.sentences() == ["The table is level within 0.02 mm at its legs: leave them."]


def test_advice_names_leg_amount_and_uncertainty():
    advice = levelling((1e-4 * G_M_S2, 0.0), SURE, LEGS)
    assert advice.sentences()[1] == "Raise leg B by 0.36 mm (± 0.00 mm)."
    assert advice.sentences()[0] == "Leave leg A as it is."


def test_the_sigma_of_a_leg_is_that_of_the_slope_times_its_distance():
    sigma = 1e-4 * G_M_S2
    legs = levelling((0.02, 0.0), np.diag([sigma**2, 0.0]), LEGS).legs
    assert {leg.name: round(1e3 * leg.sigma_m, 6) for leg in legs} == {
        "A": 0.0,
        "B": 0.36,
        "C": 0.36,
        "D": 0.0,
    }


@pytest.mark.parametrize(
    ("legs", "complaint"),
    [
        ({"A": (0.0, 0.0), "B": (1.0, 0.0)}, "at least three"),
        ({"A": (0.0, 0.0), "B": (1.0, 0.0), "C": (2.0, 0.0)}, "on one line"),
        ({"A": (0.0, 0.0), "B": (0.0, 0.0), "C": (0.0, 0.0)}, "on one line"),
        ({"A": (0.0, 0.0), "B": (1.0, 0.0), "C": (float("nan"), 1.0)}, "finite"),
    ],
)
def test_legs_that_cannot_level_are_refused(legs, complaint):
    with pytest.raises(ValueError, match=complaint):
        levelling((0.0, 0.0), SURE, legs)
