"""Experiments as files: who flies, what happens when, what counts as success."""

from groundstation.scenario.loading import Scenario, load
from groundstation.scenario.notebook import Flown, run

__all__ = ["Flown", "Scenario", "load", "run"]
