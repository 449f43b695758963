"""From spots to a pose: tracking from a prior, or lost in space; one call of the core per picture.

Lost in space: triangles of neighbouring spots are looked up among the catalogue's triangles; each hit
is a pose; all poses are tested at once on the raster of nearest stars; the best are refined and must
pass the likelihood test. Pictures with few spots go on with pairs. The work is capped, so a picture
that shows no ceiling costs a bounded time. With a prior, the stars near where it puts the spots are
matched directly, and lost-in-space is the fallback.

The steps are ``core/star_*.c``.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.core.library import default_core
from groundstation.star_tracking import tracker_settings as constants
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import BodyMotion, Mode, PictureFix, PoseGuess, PosePrior
from groundstation.star_tracking.rays import CeilingRays
from groundstation.star_tracking.sky_index import SkyIndex
from groundstation.star_tracking.tracker_settings import TrackerSettings

_ROOM = 128  # spots to begin with; more come seldom


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What a search came to.

    Attributes:
        fix: The pose, if one was found and believed.
        best_nats: Best log likelihood over chance of any pose that was refined.
        best_guess: That pose.
        is_ambiguous: There was a fix, but another place of the catalogue explains the picture as well.
        tear_nats: With a fix: log likelihood over chance that one end of the picture shows other stars.
        tear_px: With a fix: the largest step between the residuals of two parts of the picture.
    """

    fix: PictureFix | None
    best_nats: float
    best_guess: PoseGuess | None
    is_ambiguous: bool = False
    tear_nats: float = 0.0
    tear_px: float = 0.0


class Search:
    """Finds the pose of enough spots; for one thread at a time, since it keeps its buffers.

    Args:
        sky: Tables over the catalogue.
        rays: Pixel to ceiling.
        settings: How hard to try.
        is_dropped: Catalogue rows that no spot is matched to, and False for the star that is none, shape
            (stars + 1,), contiguous; the owner may change it between pictures.

    Raises:
        CoreError: There is no compiled core.
    """

    def __init__(
        self, sky: SkyIndex, rays: CeilingRays, settings: TrackerSettings, is_dropped: NDArray[np.bool_]
    ) -> None:
        core = default_core()
        self._lib, self._ffi = core.lib, core.ffi
        self._held: list[Any] = []  # pointers that the structures hold, and with them their arrays
        self._stars = len(sky.position_m)
        self._rays = self._rays_of(rays)
        self._sky = self._sky_of(sky, is_dropped)
        self._settings = self._settings_of(settings)
        self._picture = picture = self._ffi.new("StarPicture *")
        self._covariance, self._prior_covariance = (
            np.frombuffer(self._ffi.buffer(field)).reshape(3, 3)
            for field in (picture.covariance, picture.prior_covariance)
        )
        self._make_room(_ROOM)

    def find(self, spots: Spots, prior: PosePrior | None, motion: BodyMotion | None) -> Found:
        """Search one picture.

        Args:
            spots: Brightest first; enough of them for a fix with, or without, a prior.
            prior: What is believed of the pose.
            motion: Velocity during the exposure.
        """
        n, picture = len(spots), self._picture
        if n > self._room:
            self._make_room(2 * n)
        picture.spots = n
        self._u_px[:n], self._v_px[:n] = spots.u_px, spots.v_px
        self._covariance_px2[:n], self._streak_px[:n] = spots.covariance_px2, spots.streak_px
        picture.has_prior = prior is not None
        if prior is not None:
            picture.prior_x_m, picture.prior_y_m = prior.x_table_m, prior.y_table_m
            picture.prior_heading_rad = prior.heading_rad
            self._prior_covariance[:] = prior.covariance
        picture.has_motion = motion is not None
        if motion is not None:
            picture.vx_table_m_s, picture.vy_table_m_s = motion.vx_table_m_s, motion.vy_table_m_s
            picture.rate_rad_s = motion.rate_rad_s
        self._lib.gs_star_solve(self._sky, self._rays, self._settings, picture)
        if not picture.is_fix:
            guess = PoseGuess(*picture.guess) if math.isfinite(picture.best_nats) else None
            return Found(None, picture.best_nats, guess, bool(picture.is_ambiguous))
        self._lib.gs_star_tears(self._sky, self._rays, self._settings, picture)
        stars = picture.stars
        fix = PictureFix(
            x_m=picture.x_m,
            y_m=picture.y_m,
            heading_rad=picture.heading_rad,
            covariance=self._covariance.copy(),
            stars=stars,
            mode=Mode.TRACKING if picture.is_tracked else Mode.LOST_IN_SPACE,
            spot_index=self._spot_index[:stars].astype(np.int64),
            star_index=self._star_index[:stars].astype(np.int64),
            residual_m=self._residual_m[:stars].copy(),
            evidence_nats=picture.evidence_nats,
        )
        return Found(fix, picture.best_nats, None, tear_nats=picture.tear_nats, tear_px=picture.tear_px)

    def _make_room(self, spots: int) -> None:
        """Allocate buffers for pictures of so many spots."""
        self._room = spots
        self._u_px, self._v_px = np.zeros(spots), np.zeros(spots)
        self._covariance_px2, self._streak_px = np.zeros((spots, 3)), np.zeros((spots, 2))
        self._spot_index, self._star_index = np.zeros(spots, np.int32), np.zeros(spots, np.int32)
        self._residual_m = np.zeros((spots, 2))
        view, new = self._ffi.from_buffer, self._ffi.new
        buffers = {
            **{name: view("double[]", getattr(self, f"_{name}")) for name in ("u_px", "v_px")},
            **{name: view("double[]", getattr(self, f"_{name}")) for name in ("covariance_px2", "streak_px")},
            **{name: view("int32_t[]", getattr(self, f"_{name}")) for name in ("spot_index", "star_index")},
            "residual_m": view("Point[]", self._residual_m),
            "doubles": new("double[]", self._lib.gs_star_doubles(spots)),
            "integers": new("int32_t[]", self._lib.gs_star_integers(spots, self._stars, self._settings)),
        }
        for name, buffer in buffers.items():
            setattr(self._picture, name, buffer)
        self._buffers = buffers

    def _pointer(self, to: str, array: NDArray[np.generic], kind: type[np.generic]) -> Any:  # noqa: ANN401
        """Give a pointer to an array that lives as long as this object."""
        self._held.append(self._ffi.from_buffer(f"{to}[]", np.ascontiguousarray(array, dtype=kind)))
        return self._held[-1]

    def _doubles(self, array: NDArray[np.generic]) -> Any:  # noqa: ANN401
        return self._pointer("double", array, np.float64)

    def _integers(self, array: NDArray[np.generic]) -> Any:  # noqa: ANN401
        return self._pointer("int32_t", array, np.int32)

    def _rays_of(self, rays: CeilingRays) -> Any:  # noqa: ANN401
        same = {name: getattr(rays, name) for name in ("columns", "rows", "step_px", "scale_m_px", "reach_m")}
        made = {"table": self._doubles(rays.table), "picture_rows": rays.camera.height}
        return self._ffi.new("Rays *", {**same, **made})

    def _sky_of(self, sky: SkyIndex, is_dropped: NDArray[np.bool_]) -> Any:  # noqa: ANN401
        if not is_dropped.flags.c_contiguous:
            raise ValueError("the dropped stars must be one contiguous array, which is read in place")
        triangles, raster = sky.triangles, sky.raster
        rows, columns = raster.star.shape
        return self._ffi.new(
            "Sky *",
            {
                "star": self._pointer("Point", sky.padded_m, np.complex128),
                "variance_m2": self._doubles(sky.variance_m2),
                "is_dropped": self._pointer("uint8_t", is_dropped, np.bool_),
                "stars": self._stars,
                "raster": self._integers(raster.star),
                "columns": columns,
                "rows": rows,
                "x0_m": raster.x0_m,
                "y0_m": raster.y0_m,
                "cells_per_m": 1.0 / raster.cell_m,
                "area_m2": sky.area_m2,
                "density_m2": sky.density_m2,
                "tolerance_m": sky.tolerance_m,
                "key_m": self._doubles(triangles.key_m),
                "triangle": self._integers(triangles.star),
                "starts": self._integers(triangles.starts),
                "cells": triangles.cells,
                "cell_m": triangles.cell_m,
                "reach_m": triangles.reach_m,
                "pair": self._integers(sky.pairs),
                "pair_length_m": self._doubles(sky.pair_length_m),
                "pairs": len(sky.pairs),
            },
        )

    def _settings_of(self, settings: TrackerSettings) -> Any:  # noqa: ANN401
        """Fill in the fields that are named alike, and the arrays."""
        ranks = np.array(constants.NEIGHBOUR_RANKS)
        groups, sigmas_px = constants.RANK_GROUPS, settings.evidence_sigmas_px
        made = {
            "sigmas_px": self._doubles(np.array(sigmas_px)),
            "sigmas": len(sigmas_px),
            "ranks": self._integers(ranks),
            "rank_groups": self._integers(np.array(groups)),
            "groups": len(groups),
            "neighbours": int(ranks.max()) + 2,  # ranks count from 0, and every spot is its own nearest
        }
        for name, _ in self._ffi.typeof("SearchSettings").fields:
            if name not in made:
                is_setting = hasattr(settings, name)
                made[name] = getattr(settings, name) if is_setting else getattr(constants, name.upper())
        return self._ffi.new("SearchSettings *", made)
