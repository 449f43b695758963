"""Every estimator that a rig or a command can name: one row each."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.estimator import EstimatorFactory
from groundstation.fusion.reintegration import ReintegrationEstimator

ESTIMATORS: Mapping[str, EstimatorFactory] = MappingProxyType(
    {
        "filter": ErrorStateFilter,
        "reintegration": ReintegrationEstimator,
    }
)
