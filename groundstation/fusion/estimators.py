"""Every estimator that a rig or a command can name: one row each."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.estimator import EstimatorFactory
from groundstation.fusion.published_motion import PublishedFactory, imu_alone, joint, stars_alone

PUBLISHED: Mapping[str, PublishedFactory] = MappingProxyType(
    {"reintegration": joint, "stars": stars_alone, "imu": imu_alone}
)
"""Those as they are published; they take settings."""
ESTIMATORS: Mapping[str, EstimatorFactory] = MappingProxyType({"filter": ErrorStateFilter, **PUBLISHED})
