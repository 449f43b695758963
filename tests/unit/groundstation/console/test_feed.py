"""The feed of the console: the newest of everything, and what is tapped."""

import pytest
from oracles.hand_fed_console import batch_of, state_of

from groundstation.console.chart_tap import ChartTap, UnknownFieldError
from groundstation.console.feed import Feed
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.table import own_tables


def test_the_newest_of_each_owner_is_kept(feed: Feed) -> None:
    feed.take_batch(batch_of([state_of("alpha", 1), state_of("beta", 2), state_of("alpha", 3, x_m=1.5)]), 10)
    found = feed.get(VehicleState, "alpha")
    assert found is not None
    assert (found.stamp_ns, found.position_table_m) == (3, (1.5, -0.5))
    assert feed.get(VehicleState, "beta").stamp_ns == 2  # type: ignore[union-attr]
    assert feed.get(VehicleState, "gamma") is None
    assert feed.arrived_ns(VehicleState, "alpha") == 10
    assert feed.counts["state", "alpha"] == 2


@pytest.mark.parametrize("cut", [0, 3, 11, 20, -1, -30])
def test_a_batch_that_is_cut_off_changes_nothing(feed: Feed, cut: int) -> None:
    whole = batch_of([state_of("alpha", 1)])
    feed.take_batch(whole[:cut], 5)
    assert feed.refused == 1
    assert not feed.newest


def test_a_payload_of_another_layout_is_counted_and_not_shown(feed: Feed) -> None:
    feed.take_one(("state", "alpha"), b"\x00\x01\x00\x00\x05", 1)
    assert feed.get(VehicleState, "alpha") is None
    assert feed.refused == 1


def test_a_tap_has_every_sample_in_order(feed: Feed) -> None:
    tap = ChartTap(["alpha/state.position_table_m[0]", "alpha/state.heading_rad"], own_tables().payloads)
    feed.tap(tap)
    for start in (0, 3):
        feed.take_batch(
            batch_of([state_of("alpha", (start + i) * 10**9, x_m=start + i) for i in range(3)]), 0
        )
    feed.take_batch(batch_of([state_of("beta", 99 * 10**9)]), 0)
    times_s, values = tap.samples()["alpha/state.position_table_m[0]"]
    assert times_s.tolist() == [0, 1, 2, 3, 4, 5]
    assert values.tolist() == [0, 1, 2, 3, 4, 5]
    assert tap.samples() == {}
    feed.untap(tap)
    feed.take_batch(batch_of([state_of("alpha", 7)]), 0)
    assert tap.samples() == {}


@pytest.mark.parametrize(
    "name",
    ["", "state", "alpha/state", "alpha/state.nothing", "alpha/state.status", "alpha/nothing.x", "a.b"],
)
def test_a_field_that_is_no_number_is_refused_by_name(name: str) -> None:
    with pytest.raises(UnknownFieldError):
        ChartTap([name], own_tables().payloads)
