"""Flying by the camera over the table: alone, beside the stars, and when one of both fails."""

from collections import Counter

import numpy as np
import pytest

from groundstation.parts.fusion.messages import FixAccount
from groundstation.parts.overhead.messages import FixComparison, OverheadFix

FLY_S = 24.0
FAULT = '\n[[laboratory.faults]]\nkind = "{kind}"\nvehicle = "alpha"\nstart_s = 12.0\n'


@pytest.mark.slow
def test_both_sources_hold_the_station_and_the_referee_finds_them_at_one(fly):
    flight = fly(rig="overhead", seed=5).run(FLY_S)
    for vehicle, sources in (("alpha", {"stars", "overhead"}), ("beta", {"overhead"})):
        used = Counter(a.source for a in flight.of(FixAccount, vehicle) if a.used)
        assert set(used) == sources
        assert used["overhead"] > 0.95 * len(flight.of(OverheadFix, vehicle))
        distances, turns = flight.off_goal(vehicle, 18.0)
        assert np.sqrt(np.mean(distances**2)) < 0.01
        assert np.sqrt(np.mean(turns**2)) < np.radians(0.5)
        compared = flight.of(FixComparison, vehicle)
        assert {pair.verdict for pair in compared} <= {"too few", "agree"}
        assert 0.05 < np.mean([pair.nis for pair in compared]) / 3 < 2.0  # floors are not drawn
    late = [a for a in flight.of(FixAccount, "alpha", 3.0) if a.source == "stars"]
    assert sum(a.used for a in late) > 0.9 * len(late)  # though each comes after later ones from above


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "silent", "going"), [("dead_sky", "stars", "overhead"),
                                                       ("hidden_discs", "overhead", "stars")])  # fmt: skip
def test_one_source_carries_on_when_the_other_fails(fly, kind, silent, going):
    flight = fly(FAULT.format(kind=kind), rig="overhead", seed=6).run(FLY_S)
    used = Counter(a.source for a in flight.of(FixAccount, "alpha", 14.0) if a.used)
    assert used[silent] == 0
    assert used[going] > 10
    distances, _ = flight.off_goal("alpha", 18.0)
    assert np.sqrt(np.mean(distances**2)) < 0.02
    if kind == "hidden_discs":
        refusals = [f.reason for f in flight.of(OverheadFix, "alpha", 13.0) if not f.fix]
        assert refusals
        assert all("circle" in reason for reason in refusals)
