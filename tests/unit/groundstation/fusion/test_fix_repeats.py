"""A source that gives one pose twice is frozen."""

import pytest

from groundstation.fusion.fix_repeats import REMEMBERED, FixRepeats

POSE = (1.0, 0.2, 0.1)


def test_a_pose_equal_in_all_three_numbers_is_refused_and_one_equal_in_two_is_not():
    repeats = FixRepeats()
    assert not repeats.is_repeated("stars", POSE)
    assert repeats.is_repeated("stars", POSE)
    assert repeats.is_repeated("stars", POSE)
    for which in range(3):
        other = tuple(value + 1e-12 * (index == which) for index, value in enumerate(POSE))
        assert not repeats.is_repeated("stars", other)


def test_each_source_is_compared_with_itself():
    repeats = FixRepeats()
    assert not repeats.is_repeated("stars", POSE)
    assert not repeats.is_repeated("overhead", POSE)
    assert repeats.is_repeated("overhead", POSE)


@pytest.mark.parametrize(("length", "refused"), [(REMEMBERED, True), (REMEMBERED + 1, False)])
def test_a_loop_is_noticed_up_to_the_number_of_poses_remembered(length, refused):
    repeats = FixRepeats()
    found = [repeats.is_repeated("stars", (0.01 * (t % length), 0.2, 0.1)) for t in range(2 * length)]
    assert not any(found[:length])
    assert all(found[length:]) is refused
