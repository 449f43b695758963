"""What a student's notebook needs: load, vary, run, results as arrays.

from groundstation import scenario

flown = scenario.run(scenario.load("examples/scenarios/go_to.toml"), seed=3)
flown.passed, flown["alpha.settling_s"]
t_s, x_m, y_m, heading_rad = flown.truth("alpha")[:4]
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields
from types import MappingProxyType
from typing import Any

from groundstation.control.controller import NO_NEIGHBOURS, Controller
from groundstation.control.state import BodyWrench, ControlState, Goal
from groundstation.declarations.errors import UsageError
from groundstation.scenario.flight_log import Array, VehicleTrack
from groundstation.scenario.judging import Judged
from groundstation.scenario.loading import Scenario
from groundstation.scenario.rehearsal import check_failures
from groundstation.scenario.running import fly, seed_for
from groundstation.scenario.scenario_file import ScenarioError
from groundstation.watch.verdict import PASSED, LimitOutcome, RunEvent

Law = Callable[[ControlState, Goal, float], tuple[float, float, float]]
"""State, goal and time step (s) in; force along body x and y (N) and torque (N m) out."""
COLUMNS = ("t_s", "x_m", "y_m", "heading_rad", "vx_m_s", "vy_m_s")


class FunctionLaw:
    """A function as a controller; it holds no past of its own.

    Args:
        function: Called ten times a second.
    """

    def __init__(self, function: Law) -> None:
        self._function = function

    def reset(self) -> None:
        """There is nothing to forget."""

    def setpoint(self, goal: Goal) -> Goal:
        """The goal itself."""
        return goal

    def update(
        self,
        state: ControlState,
        goal: Goal,
        dt_s: float,
        *,
        applied: BodyWrench | None = None,
        neighbours: Mapping[str, ControlState] = NO_NEIGHBOURS,
    ) -> BodyWrench:
        """See `Controller.update`."""
        del applied, neighbours
        force_x_n, force_y_n, torque_nm = self._function(state, goal, dt_s)
        return BodyWrench((force_x_n, force_y_n), torque_nm)


@dataclass(frozen=True, repr=False)
class Flown:
    """A run in virtual time, judged.

    Attributes:
        judged: Verdict and quantities.
    """

    judged: Judged

    def __repr__(self) -> str:
        verdict = self.judged.verdict
        return f"<{verdict.title}: {verdict.verdict}{f', {verdict.reason}' if verdict.reason else ''}>"

    @property
    def passed(self) -> bool:
        """Whether all limits held, and everybody ended as it should."""
        return self.judged.verdict.verdict == PASSED

    @property
    def reason(self) -> str:
        """Why it has not passed; empty where it has."""
        return self.judged.verdict.reason

    @property
    def limits(self) -> tuple[LimitOutcome, ...]:
        """Every limit and what became of it."""
        return self.judged.verdict.limits

    @property
    def events(self) -> tuple[RunEvent, ...]:
        """What happened, in order."""
        return self.judged.verdict.events

    def __getitem__(self, quantity: str) -> float:
        """A quantity over the whole run: ``flown["alpha.gas_ns"]``, ``["alpha-beta.least_distance_mm"]``.

        Raises:
            KeyError: There is none of that name.
        """
        if quantity not in self.judged.values:
            known = ", ".join(self.judged.values) or f"nothing was flown: {self.reason}"
            raise KeyError(f"no quantity is called {quantity!r} ({known})")
        return self.judged.values[quantity].value

    @property
    def quantities(self) -> dict[str, float]:
        """All of them, by name."""
        return {name: value.value for name, value in self.judged.values.items()}

    def truth(self, vehicle: str) -> Array:
        """Truth of a vehicle: t (s), x, y (m), heading (rad, unwrapped), velocity x, y (m/s); shape (6, n).

        Raises:
            ValueError: t = 0 never came, so nothing was flown.
            KeyError: There is no such vehicle.
        """
        return self._tracks(vehicle).truth.T

    def estimate(self, vehicle: str) -> Array:
        """The estimate, as ``truth``."""
        return self._tracks(vehicle).state.T

    def frame(self, vehicle: str) -> Any:  # noqa: ANN401 pandas is an extra
        """Truth of a vehicle as a pandas DataFrame, a row per sample.

        Raises:
            UsageError: pandas is not installed (extra ``notebook``).
            ValueError: t = 0 never came, so nothing was flown.
            KeyError: There is no such vehicle.
        """
        return _pandas().DataFrame(self.truth(vehicle).T, columns=list(COLUMNS))

    def limits_frame(self) -> Any:  # noqa: ANN401 pandas is an extra
        """Every limit and what became of it as a pandas DataFrame, a row each; vehicles joined by ``-``.

        Raises:
            UsageError: pandas is not installed (extra ``notebook``).
        """
        rows = [asdict(limit) | {"vehicles": "-".join(limit.vehicles)} for limit in self.limits]
        return _pandas().DataFrame(rows, columns=[field.name for field in fields(LimitOutcome)])

    def _tracks(self, vehicle: str) -> VehicleTrack:
        if self.judged.flown is None:
            raise ValueError(f"nothing was flown: {self.reason}")
        tracks = self.judged.flown.tracks
        if vehicle not in tracks:
            raise KeyError(f"there is no vehicle {vehicle!r} (there are: {', '.join(tracks)})")
        return tracks[vehicle]


def _pandas() -> Any:  # noqa: ANN401 an extra
    try:
        import pandas
    except ImportError as error:
        raise UsageError("DataFrames need pandas: pip install 'groundstation[notebook]'.") from error
    return pandas


def run(
    scenario: Scenario,
    seed: int | None = None,
    laws: Mapping[str, Law | Controller] = MappingProxyType({}),
) -> Flown:
    """Fly a scenario in virtual time; nothing is written.

    Args:
        scenario: From ``load``, perhaps varied.
        seed: Of the laboratory; None takes the scenario's.
        laws: By vehicle, a function or a controller in the place of the scenario's.

    Raises:
        UsageError: The laboratory refuses what the scenario asks, or a law is none, or for no vehicle of the
            rig, or the seed is none.
        TypeError: It is no scenario.
    """
    if not isinstance(scenario, Scenario):
        raise TypeError(f"scenario.run takes what scenario.load returns, found {scenario!r:.80}")
    for name, law in laws.items():
        if not (callable(law) or hasattr(law, "update")):
            raise ScenarioError(
                f"{scenario.path}: laws: {name}: expected a controller or a function of state, goal, dt_s, "
                f"found {law!r:.80}"
            )
        if name not in scenario.rig.vehicles:
            raise ScenarioError(
                f"{scenario.path}: laws: the rig has no vehicle {name!r} (it has: "
                f"{', '.join(scenario.rig.vehicles)})"
            )
    check_failures(scenario)
    own = {name: FunctionLaw(law) if callable(law) else law for name, law in laws.items()}
    return Flown(fly(scenario, seed_for(scenario, seed), laws=own))
