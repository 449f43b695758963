"""A prior is used only while it keeps being confirmed."""

import numpy as np

from groundstation.star_tracking.fixes import Mode, NoFix, PictureFix, PosePrior, Refusal
from groundstation.star_tracking.prior_governor import GovernorSettings, PriorGovernor

NONE = np.zeros(0, np.int64)


def fix(mode, x=1.0):
    return PictureFix(x, 2.0, 0.5, np.eye(3) * 1e-8, 9, mode, NONE, NONE, np.zeros((0, 2)), 50.0)


def prior(sigma=0.005, x=1.0):
    return PosePrior(x, 2.0, 0.5, np.eye(3) * sigma**2)


REFUSED = NoFix(Refusal.NO_CONSENSUS, "none", 5)


def test_the_first_picture_is_searched_from_nothing():
    assert PriorGovernor().admit(prior()) is None


def test_after_a_confirmed_fix_the_prior_is_used_until_the_next_confirmation_is_due():
    governor = PriorGovernor(GovernorSettings(confirm_every=3))
    governor.note(fix(Mode.LOST_IN_SPACE))
    for _ in range(3):
        assert governor.admit(prior()) is not None
        governor.note(fix(Mode.TRACKING), prior())
    assert governor.admit(prior()) is None
    governor.note(fix(Mode.LOST_IN_SPACE), prior())
    assert governor.admit(prior()) is not None


def test_a_refusal_or_a_contradicted_prior_forces_a_search_from_nothing():
    governor = PriorGovernor()
    governor.note(fix(Mode.LOST_IN_SPACE))
    governor.note(REFUSED)
    assert governor.admit(prior()) is None
    governor.note(fix(Mode.LOST_IN_SPACE))
    governor.note(fix(Mode.TRACKING), prior(x=1.1))
    assert governor.admit(prior()) is None


def test_a_vague_or_undefined_prior_is_not_used():
    governor = PriorGovernor()
    governor.note(fix(Mode.LOST_IN_SPACE))
    assert governor.admit(prior(sigma=0.1)) is None
    assert governor.admit(PosePrior(1.0, 2.0, 0.5, np.full((3, 3), np.nan))) is None
    assert governor.admit(None) is None
