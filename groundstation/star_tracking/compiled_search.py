"""The search of ``search`` in the compiled core: one call per picture, with equal answers."""

import math
from ctypes import Structure, byref, c_double, c_int64, c_void_p
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from groundstation.core.library import Core
from groundstation.star_tracking import motion as smear
from groundstation.star_tracking import refinement
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.evidence import STRAY_RATIO
from groundstation.star_tracking.fixes import BodyMotion, Mode, PoseGuess, PosePrior, StarFix
from groundstation.star_tracking.hypotheses import NEIGHBOUR_RANKS, RANK_GROUPS
from groundstation.star_tracking.rays import CeilingRays
from groundstation.star_tracking.search import Found
from groundstation.star_tracking.settings import TrackerSettings
from groundstation.star_tracking.sky_index import SkyIndex

_ROOM = 128  # spots to begin with; more come seldom


class _Rays(Structure):
    """``gs_rays`` of core/star_tracker.h, where all fields are told; so are those below."""

    _fields_: ClassVar = [
        ("table", c_void_p),
        *((name, c_int64) for name in ("columns", "rows")),
        *((name, c_double) for name in ("step_px", "picture_rows", "scale_m_px", "reach_m")),
    ]


class _Sky(Structure):
    """``gs_sky``."""

    _fields_: ClassVar = [
        *((name, c_void_p) for name in ("star", "variance_m2", "is_dropped")),
        ("stars", c_int64),
        ("raster", c_void_p),
        *((name, c_int64) for name in ("columns", "rows")),
        *(
            (name, c_double)
            for name in ("x0_m", "y0_m", "cells_per_m", "area_m2", "density_m2", "tolerance_m")
        ),
        *((name, c_void_p) for name in ("key_m", "triangle", "starts")),
        ("cells", c_int64 * 3),
        *((name, c_double) for name in ("cell_m", "reach_m")),
        *((name, c_void_p) for name in ("pair", "pair_length_m")),
        ("pairs", c_int64),
    ]


class _Settings(Structure):
    """``gs_star_settings``."""

    _fields_: ClassVar = [
        *((name, c_int64) for name in ("min_stars", "min_stars_prior", "identified_spots")),
        *((name, c_int64) for name in ("pair_spots", "pair_spots_total", "look_ups", "candidates")),
        *(
            (name, c_double)
            for name in ("centre_floor_px", "streak_floor_ratio", "evidence_nats", "rival_nats")
        ),
        *((name, c_double) for name in ("exposure_s", "readout_s")),
        ("sigmas_px", c_void_p),
        ("sigmas", c_int64),
        ("stray_ratio", c_double),
        *((name, c_void_p) for name in ("ranks", "rank_groups")),
        *((name, c_int64) for name in ("groups", "neighbours", "refine_steps")),
        *((name, c_double) for name in ("prior_freedom", "clip_sigmas")),
        *((name, c_double) for name in ("min_streak_px", "min_streak_share", "max_misfit_ratio")),
        *((name, c_int64) for name in ("min_streaks", "smear_rounds")),
    ]


class _Picture(Structure):
    """``gs_star_picture``."""

    _fields_: ClassVar = [
        ("spots", c_int64),
        *((name, c_void_p) for name in ("u_px", "v_px", "cov_px2", "streak_px")),
        ("has_prior", c_int64),
        *((name, c_double) for name in ("prior_x_m", "prior_y_m", "prior_heading_rad")),
        ("prior_cov", c_double * 9),
        ("has_motion", c_int64),
        *((name, c_double) for name in ("vx_table_m_s", "vy_table_m_s", "omega_rad_s")),
        *((name, c_void_p) for name in ("doubles", "integers")),
        *((name, c_int64) for name in ("is_fix", "is_tracked", "is_ambiguous", "stars")),
        *((name, c_double) for name in ("x_m", "y_m", "heading_rad")),
        ("cov", c_double * 9),
        *((name, c_double) for name in ("evidence_nats", "best_nats")),
        ("guess", c_double * 3),
        *((name, c_void_p) for name in ("spot_index", "star_index", "residual_m")),
    ]


STRUCTURES = (_Rays, _Sky, _Settings, _Picture)


class CompiledSearch:
    """The search in the compiled core; for one thread at a time, since it keeps its buffers.

    Args:
        core: The compiled core.
        sky: Tables over the catalogue.
        rays: Pixel to ceiling.
        settings: How hard to try.
        is_dropped: As for ``PureSearch``.
    """

    def __init__(
        self,
        core: Core,
        sky: SkyIndex,
        rays: CeilingRays,
        settings: TrackerSettings,
        is_dropped: NDArray[np.bool_],
    ) -> None:
        self._solve = core.function("gs_star_solve", None, c_void_p, c_void_p, c_void_p, c_void_p)
        self._doubles = core.function("gs_star_doubles", c_int64, c_int64)
        self._integers = core.function("gs_star_integers", c_int64, c_int64, c_int64, c_void_p)
        self._held: list[NDArray[np.generic]] = []  # what the structures point to
        self._stars = len(sky.position_m)
        self._rays = self._rays_of(rays)
        self._sky = self._sky_of(sky, is_dropped)
        self._settings = self._settings_of(settings)
        self._picture = _Picture()
        self._cov = np.ctypeslib.as_array(self._picture.cov).reshape(3, 3)
        self._prior_cov = np.ctypeslib.as_array(self._picture.prior_cov).reshape(3, 3)
        self._arguments = tuple(byref(s) for s in (self._sky, self._rays, self._settings, self._picture))
        self._make_room(_ROOM)

    def find(self, spots: Spots, prior: PosePrior | None, motion: BodyMotion | None) -> Found:
        """Search one picture, as ``PureSearch.find``."""
        n, picture = len(spots), self._picture
        if n > self._room:
            self._make_room(2 * n)
        picture.spots = n
        self._u_px[:n], self._v_px[:n] = spots.u_px, spots.v_px
        self._cov_px2[:n], self._streak_px[:n] = spots.cov_px2, spots.streak_px
        picture.has_prior = prior is not None
        if prior is not None:
            picture.prior_x_m, picture.prior_y_m = prior.x_table_m, prior.y_table_m
            picture.prior_heading_rad = prior.heading_rad
            self._prior_cov[:] = prior.cov
        picture.has_motion = motion is not None
        if motion is not None:
            picture.vx_table_m_s, picture.vy_table_m_s = motion.vx_table_m_s, motion.vy_table_m_s
            picture.omega_rad_s = motion.omega_rad_s
        self._solve(*self._arguments)
        if not picture.is_fix:
            guess = PoseGuess(*picture.guess) if math.isfinite(picture.best_nats) else None
            return Found(None, picture.best_nats, guess, bool(picture.is_ambiguous))
        stars = picture.stars
        fix = StarFix(
            x_m=picture.x_m,
            y_m=picture.y_m,
            heading_rad=picture.heading_rad,
            cov=self._cov.copy(),
            stars=stars,
            mode=Mode.TRACKING if picture.is_tracked else Mode.LOST_IN_SPACE,
            spot_index=self._spot_index[:stars].astype(np.int64),
            star_index=self._star_index[:stars].astype(np.int64),
            residual_m=self._residual_m[:stars].copy(),
            evidence_nats=picture.evidence_nats,
        )
        return Found(fix, picture.best_nats, None)

    def _make_room(self, spots: int) -> None:
        """Allocate buffers for pictures of so many spots."""
        self._room = spots
        self._u_px, self._v_px = np.zeros(spots), np.zeros(spots)
        self._cov_px2, self._streak_px = np.zeros((spots, 3)), np.zeros((spots, 2))
        self._spot_index, self._star_index = np.zeros(spots, np.int32), np.zeros(spots, np.int32)
        self._residual_m = np.zeros((spots, 2))
        self._scratch = (
            np.zeros(self._doubles(spots)),
            np.zeros(self._integers(spots, self._stars, byref(self._settings)), np.int32),
        )
        for name in ("u_px", "v_px", "cov_px2", "streak_px", "spot_index", "star_index", "residual_m"):
            setattr(self._picture, name, getattr(self, f"_{name}").ctypes.data)
        self._picture.doubles, self._picture.integers = (array.ctypes.data for array in self._scratch)

    def _address(self, array: NDArray[np.generic], kind: type[np.generic]) -> int:
        """Give the address of an array that lives as long as this object."""
        held = np.ascontiguousarray(array, dtype=kind)
        self._held.append(held)
        return held.ctypes.data

    def _rays_of(self, rays: CeilingRays) -> _Rays:
        return _Rays(
            table=self._address(rays.table, np.float64),
            columns=rays.columns,
            rows=rays.rows,
            step_px=rays.step_px,
            picture_rows=rays.camera.height,
            scale_m_px=rays.scale_m_px,
            reach_m=rays.reach_m,
        )

    def _sky_of(self, sky: SkyIndex, is_dropped: NDArray[np.bool_]) -> _Sky:
        if not is_dropped.flags.c_contiguous:
            raise ValueError("the dropped stars must be one contiguous array, which is read in place")
        triangles, raster = sky.triangles, sky.raster
        rows, columns = raster.star.shape
        return _Sky(
            star=self._address(sky.padded_m, np.complex128),
            variance_m2=self._address(sky.variance_m2, np.float64),
            is_dropped=self._address(is_dropped, np.bool_),
            stars=self._stars,
            raster=self._address(raster.star, np.int32),
            columns=columns,
            rows=rows,
            x0_m=raster.x0_m,
            y0_m=raster.y0_m,
            cells_per_m=1.0 / raster.cell_m,
            area_m2=sky.area_m2,
            density_m2=sky.density_m2,
            tolerance_m=sky.tolerance_m,
            key_m=self._address(triangles.key_m, np.float64),
            triangle=self._address(triangles.star, np.int32),
            starts=self._address(triangles.starts, np.int32),
            cells=triangles.cells,
            cell_m=triangles.cell_m,
            reach_m=triangles.reach_m,
            pair=self._address(sky.pairs, np.int32),
            pair_length_m=self._address(sky.pair_length_m, np.float64),
            pairs=len(sky.pairs),
        )

    def _settings_of(self, settings: TrackerSettings) -> _Settings:
        ranks = np.array(NEIGHBOUR_RANKS)
        same = {name: getattr(settings, name) for name, *_ in _Settings._fields_ if hasattr(settings, name)}
        return _Settings(
            **same,
            sigmas_px=self._address(np.array(settings.evidence_sigmas_px), np.float64),
            sigmas=len(settings.evidence_sigmas_px),
            stray_ratio=STRAY_RATIO,
            ranks=self._address(ranks, np.int32),
            rank_groups=self._address(np.array(RANK_GROUPS), np.int32),
            groups=len(RANK_GROUPS),
            neighbours=int(ranks.max()) + 2,  # ranks count from 0, and every spot is its own nearest
            refine_steps=refinement.REFINE_STEPS,
            prior_freedom=refinement.PRIOR_FREEDOM,
            clip_sigmas=refinement.CLIP_SIGMAS,
            min_streak_px=smear.MIN_STREAK_PX,
            min_streak_share=smear.MIN_STREAK_SHARE,
            max_misfit_ratio=smear.MAX_MISFIT_RATIO,
            min_streaks=smear.MIN_STREAKS,
            smear_rounds=smear.SMEAR_ROUNDS,
        )
