"""The picture's outline on the ceiling against OpenCV's projection of the same places."""

import numpy as np
import pytest

from groundstation.star_tracking.view_outline import ViewOutline

MARGIN_PX = 12.0


def test_shown_is_what_is_projected_into_the_picture(painter):
    rng = np.random.default_rng(3)
    places = rng.uniform(-2.5, 2.5, (20_000, 2))
    uv = painter.project(0.0, 0.0, 0.0, places)  # nan far outside
    beyond = np.fmax(MARGIN_PX - uv, uv - (np.array([639.0, 479.0]) - MARGIN_PX)).max(axis=1)
    shown = ViewOutline(painter.camera, MARGIN_PX).shows(places[:, 0] + 1j * places[:, 1])
    assert shown[beyond < -0.02].all()
    assert not shown[~(beyond < 0.02)].any()
    assert shown.sum() > 1000


@pytest.mark.parametrize("margin_px", [0.0, 40.0])
def test_the_margin_is_kept_along_the_whole_border(painter, margin_px):
    outline = ViewOutline(painter.camera, margin_px)
    places = np.random.default_rng(4).uniform(-1.5, 1.5, (20_000, 2))
    uv = painter.project(0.0, 0.0, 0.0, places)[outline.shows(places[:, 0] + 1j * places[:, 1])]
    assert uv.min(axis=0) == pytest.approx(margin_px, abs=2.0)
    assert uv.max(axis=0) == pytest.approx(np.array([639.0, 479.0]) - margin_px, abs=2.0)
    assert (uv > margin_px - 0.02).all()
