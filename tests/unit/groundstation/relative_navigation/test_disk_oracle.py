"""The compiled fit of disks beside the same mathematics in NumPy."""

import numpy as np
import pytest
from oracles import disk_fit as oracle
from oracles import relative_pictures as pictures

from groundstation.relative_navigation.disk_fit import fit_disks

pytestmark = pytest.mark.core


@pytest.mark.parametrize("height", [None, 195.0])
@pytest.mark.parametrize("radius", [0.6, 0.9, 1.5, 4.0])
def test_core_and_oracle_find_the_same_disks(rng, radius, height):
    places = np.array([(30.3, 40.7), (36.1, 44.2), (80.5, 20.25), (1.4, 60.6), (118.2, 88.7)])
    picture = pictures.paint(places, np.full(5, radius), rng, size=(120, 90))
    start = places + rng.uniform(-0.3, 0.3, (5, 2))
    radii = np.full(5, 1.15 * radius)
    ours = fit_disks(picture, start, radii, 10.0, 4.0, height)
    other = oracle.fit_disks(picture, start, radii, 10.0, 4.0, height)
    assert ours.centres == pytest.approx(other.centres, abs=0.01)
    assert ours.radii == pytest.approx(other.radii, abs=0.02)
    assert ours.heights == pytest.approx(other.heights, rel=0.03)
    assert np.sqrt(ours.covariances[:, 0, 0]) == pytest.approx(np.sqrt(other.covariances[:, 0, 0]), rel=0.15)


def test_a_spot_beyond_the_picture_is_no_crash(rng):
    picture = pictures.paint([(10.0, 10.0)], [2.0], rng, size=(40, 30))
    fits = fit_disks(picture, np.array([(10.0, 10.0), (-9.0, 50.0)]), np.array([2.0, 3.0]), 10.0, 4.0)
    assert fits.centres[0] == pytest.approx([10.0, 10.0], abs=0.1)
    assert np.all(np.isfinite(fits.covariances))
