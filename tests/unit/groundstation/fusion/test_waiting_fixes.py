"""A fix that is exposed ahead of the packets waits for them, however many that takes, in every estimator."""

import pytest

from groundstation.fusion.estimator import WAITS, Fix, ImuPacket
from groundstation.fusion.estimators import ESTIMATORS

MS = 1_000_000


@pytest.mark.parametrize("method", ESTIMATORS)
@pytest.mark.parametrize("ahead", [1, 2, 40])
def test_a_fix_ahead_of_many_packets_is_settled_once_when_they_have_come(
    method, ahead, noise, fix_covariance
):
    estimator = ESTIMATORS[method](noise)

    def packets(first, last):
        for number in range(first, last):
            estimator.add_imu(ImuPacket(10 * MS * number, 0.01, 0.0, 0.0, 0.0, 20.0))

    def fix(number):
        return Fix(10 * MS * number, 10 * MS * number, 0.1, 0.2, 0.3, fix_covariance)

    packets(1, 20)
    for number in (5, 10):  # two that agree: it knows where it is
        estimator.add_fix(fix(number))
    estimator.settled()
    newest = 19 + ahead
    assert estimator.add_fix(fix(newest)).reason == WAITS
    packets(20, newest)
    assert estimator.settled() == []
    packets(newest, newest + 2)
    (account,) = estimator.settled()
    assert account.t_exposure_ns == 10 * MS * newest
    assert account.used
    assert estimator.settled() == []
