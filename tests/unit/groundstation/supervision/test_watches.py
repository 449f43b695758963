"""Samples of an IMU block and fixes, watched: what is found at which moment."""

import pytest

from groundstation.supervision.fix_watch import REFUSED_IN_A_ROW, FixWatch
from groundstation.supervision.imu_watch import ImuWatch

MS = 1_000_000
S = 1000 * MS


def sample(watch, now_ms, tick_ms, refused=""):
    """Give a sample of the block, believed unless a reason says otherwise."""
    is_valid = not refused
    watch.take(now_ms * MS, is_valid=is_valid, is_rate_usable=is_valid, reason=refused, tick_ms=tick_ms)


class TestImu:
    @pytest.fixture
    def watch(self):
        watch = ImuWatch()
        sample(watch, 0, 1000)
        return watch

    def test_before_the_first_sample_nothing_is_wrong(self):
        assert list(ImuWatch().findings(10 * S)) == []

    def test_silence_is_found_after_its_time(self, watch):
        assert list(watch.findings(299 * MS)) == []
        assert list(watch.findings(301 * MS)) == [("imu_silent", "the newest sample is 0.30 s old")]

    def bad(self, watch, reason, start_ms=10, end_ms=110):
        for now_ms in range(start_ms, end_ms + 1, 10):
            sample(watch, now_ms, 1000 + now_ms, refused=reason)

    @pytest.mark.parametrize(
        ("reason", "fault"),
        [
            ("gyro stuck at 2048", "imu_stuck"),
            ("this is block 7, the rig has 3", "imu_of_another_vehicle"),
            ("this is block 7, stuck", "imu_of_another_vehicle"),
            ("rate out of range", "imu_implausible"),
        ],
    )
    def test_refused_samples_in_a_row_are_a_fault_and_say_which(self, watch, reason, fault):
        self.bad(watch, reason)
        assert list(watch.findings(109 * MS)) == []
        assert list(watch.findings(110 * MS)) == [(fault, reason)]

    def test_one_good_sample_begins_the_count_anew(self, watch):
        self.bad(watch, "stuck", 10, 60)
        sample(watch, 70, 1070)
        self.bad(watch, "stuck", 80, 170)
        assert list(watch.findings(179 * MS)) == []
        assert [fault for fault, _ in watch.findings(180 * MS)] == ["imu_stuck"]

    def test_a_block_that_is_silent_is_not_stuck_as_well(self, watch):
        self.bad(watch, "stuck")
        assert [fault for fault, _ in watch.findings(500 * MS)] == ["imu_silent"]

    def test_a_restart_of_the_block_is_shown_for_a_second(self, watch):
        sample(watch, 10, 3)
        jumped = ("imu_clock_jumped", "the block has started again")
        assert list(watch.findings(11 * MS)) == [jumped]
        self.keep(watch, 1000, base_ms=0)
        assert jumped in watch.findings(1010 * MS - 1)
        assert list(watch.findings(1010 * MS)) == []

    def keep(self, watch, until_ms, base_ms=1000):
        for now_ms in range(20, until_ms + 1, 10):
            sample(watch, now_ms, base_ms + now_ms)

    def test_the_very_first_sample_is_no_restart(self):
        watch = ImuWatch()
        sample(watch, 0, 1000)
        assert list(watch.findings(0)) == []

    def test_ticks_far_beyond_the_wait_are_a_jump(self, watch):
        sample(watch, 10, 1210)
        assert list(watch.findings(10 * MS)) == []
        sample(watch, 30, 1431)
        assert list(watch.findings(30 * MS)) == [("imu_clock_jumped", "by 201 ms")]

    def test_ticks_that_the_line_held_up_are_none(self, watch):
        sample(watch, 600, 1800)
        assert list(watch.findings(600 * MS)) == []
        sample(watch, 1200, 2601)
        assert list(watch.findings(1200 * MS)) == [("imu_clock_jumped", "by 201 ms")]


class TestFixes:
    @pytest.fixture
    def watch(self):
        return FixWatch()

    def use(self, watch, *stamps_ms):
        for stamp_ms in stamps_ms:
            watch.take_account(stamp_ms * MS, stamp_ms * MS, is_used=True, reason="")

    def found(self, watch, now_ms):
        return dict(watch.findings(now_ms * MS))

    def test_before_the_first_fix_nothing_is_missing(self, watch):
        assert self.found(watch, 100_000) == {}

    def test_with_few_fixes_an_outage_is_three_seconds(self, watch):
        self.use(watch, 0, 100, 200)
        assert self.found(watch, 3200) == {}
        assert self.found(watch, 3201) == {"star_outage": "no fix for 3.0 s"}

    def test_three_intervals_say_how_often_fixes_come(self, watch):
        self.use(watch, 0, 1000, 2000, 3000)
        assert self.found(watch, 6000) == {}
        assert self.found(watch, 6001) == {"star_outage": "no fix for 3.0 s"}
        self.use(watch, 3200, 3400, 3600, 3800)
        assert self.found(watch, 4400) == {}
        assert "star_outage" in self.found(watch, 4401)

    def test_fast_fixes_may_be_missing_for_half_a_second(self, watch):
        self.use(watch, 0, 20, 40, 60)
        assert self.found(watch, 560) == {}
        assert "star_outage" in self.found(watch, 561)

    def test_one_long_pause_does_not_change_what_is_usual(self, watch):
        self.use(watch, 0, 1000, 2000, 3000, 13_000)
        assert "star_outage" in self.found(watch, 16_001)

    def test_what_is_usual_is_that_of_the_last_nine_intervals(self, watch):
        self.use(watch, *range(0, 9000, 1000), *range(8200, 8801, 200))
        assert "star_outage" not in self.found(watch, 11_790)  # five long intervals, four short ones
        self.use(watch, 9000)  # one long interval drops out
        assert "star_outage" not in self.found(watch, 9590)
        assert "star_outage" in self.found(watch, 9610)

    def test_fixes_that_become_rare_are_found_and_such_as_always_were_are_not(self, watch):
        self.use(watch, *range(0, 3000, 100))
        assert self.found(watch, 2990) == {}
        self.use(watch, *range(3000, 6000, 250))
        assert self.found(watch, 5990) == {"fixes_rare": "4 a second, usually 10"}
        seldom = FixWatch()
        self.use(seldom, *range(0, 20_000, 667))
        assert self.found(seldom, 20_000) == {}

    def test_refused_fixes_in_a_row_are_wrong(self, watch):
        for count in range(REFUSED_IN_A_ROW):
            assert self.found(watch, 10) == {}
            watch.take_account(count, count, is_used=False, reason="5 sigma")
        assert self.found(watch, 10) == {"wrong_fixes": "8 refused in a row: 5 sigma"}

    def test_a_used_fix_ends_the_row(self, watch):
        for count in range(2 * REFUSED_IN_A_ROW):
            watch.take_account(count * MS, count * MS, is_used=count % 7 == 6, reason="5 sigma")
        assert self.found(watch, 100) == {}

    def test_after_a_used_fix_the_row_begins_at_one(self, watch):
        self.use(watch, 0)
        for count in range(REFUSED_IN_A_ROW):
            assert self.found(watch, 10) == {}
            watch.take_account(count, count, is_used=False, reason="x")
        assert "wrong_fixes" in self.found(watch, 10)

    def test_what_was_found_lasts_a_second(self, watch):
        watch.take_picture(0, "torn picture")
        assert self.found(watch, 999) == {"camera_torn": "torn picture"}
        assert self.found(watch, 1000) == {}
        watch.take_picture(2000 * MS, "torn picture")
        assert self.found(watch, 2001) == {"camera_torn": "torn picture"}

    def test_repeats_are_a_frozen_camera_and_no_wrong_fixes(self, watch):
        for count in range(2 * REFUSED_IN_A_ROW):
            watch.take_account(count, count, is_used=False, reason="a repeat of 3 s ago")
        assert self.found(watch, 0) == {"camera_frozen": "a repeat of 3 s ago"}
        other = FixWatch()
        other.take_picture(0, "repeats the picture before")
        assert self.found(other, 0) == {"camera_frozen": "repeats the picture before"}

    def test_other_pictures_without_a_fix_are_no_fault(self, watch):
        watch.take_picture(0, "too few stars")
        assert self.found(watch, 0) == {}
