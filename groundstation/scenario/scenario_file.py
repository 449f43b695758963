"""The scenario file: its keys, and one sentence for each mistake.

What stands in it is checked here as far as the file alone goes; against its rig by ``compiling``. Formats:
TOML, metres, seconds, degrees; every key names its unit.
"""

from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field, ValidationError, model_validator

from groundstation.declarations.calls import in_one_line, shortened
from groundstation.declarations.errors import UsageError
from groundstation.declarations.names import PATTERN
from groundstation.declarations.rig import HoldSection
from groundstation.declarations.section import Section, Words
from groundstation.declarations.validation import first_sentence
from groundstation.files.errors import FileError
from groundstation.files.plain_model import PlainModel
from groundstation.files.toml_file import toml_of
from groundstation.scenario.quantities import QUANTITIES

WHAT = "scenario or rig file"
ALL, FOLLOWERS = "all", "followers"
"""Groups: every vehicle; those whose controllers follow others."""
Seconds = Annotated[float, Field(ge=0.0, le=86400.0)]
Span = Annotated[float, Field(gt=0.0, le=86400.0)]
Name = Annotated[str, Field(pattern=f"^{PATTERN}$")]


class ScenarioError(UsageError):
    """The scenario file is wrong; the text is one sentence with file and key."""

    def __init__(self, text: str) -> None:
        super().__init__(in_one_line(text))


class ControlKeys(Section):
    """Which controller flies a vehicle in this scenario, and its parameters."""

    controller: str
    parameters: dict[str, Any] = Field(default_factory=dict)


class VehicleKeys(Section):
    """What differs from the rig.

    Attributes:
        start: Where it stands at the start; on hardware, where it goes before t = 0.
        control: Its controller.
        laboratory: Keys of its entry in the emulated laboratory: the plant, noise, devices.
        may_land: Landed or stopped at the end is no failure.
    """

    start: HoldSection | None = None
    control: ControlKeys | None = None
    laboratory: dict[str, Any] = Field(default_factory=dict)
    may_land: bool = False


class Obstacle(Section):
    """A round obstacle on the table."""

    x_m: float
    y_m: float
    radius_m: Annotated[float, Field(gt=0.0, le=10.0)]


class Row(Section):
    """A row of the timeline: when, and exactly one of request, failure and mark."""

    at_s: Seconds | None = None
    when: str | None = None
    timeout_s: Span | None = None
    after_s: Seconds = 0.0
    vehicle: str | None = None
    request: str | None = None
    arguments: dict[str, float | int | str | bool] = Field(default_factory=dict)
    answer: Literal["accepted", "refused", "any"] = "accepted"
    failure: str | None = None
    parameters: dict[str, float] = Field(default_factory=dict)
    for_s: Span | None = None
    mark: Words | None = None

    @model_validator(mode="after")
    def _is_one_thing(self) -> Self:
        if (self.at_s is None) == (self.when is None):
            raise ValueError("give either 'at_s' or 'when'")
        if self.when is not None and self.timeout_s is None:
            raise ValueError("'when' needs 'timeout_s': what never comes true would wait for ever")
        if self.when is None and (self.timeout_s is not None or self.after_s):
            raise ValueError("'timeout_s' and 'after_s' go with 'when'")
        given = [name for name in ("request", "failure", "mark") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"give one of 'request', 'failure' and 'mark', found {given or 'none'}")
        if given[0] != "mark" and self.vehicle is None:
            raise ValueError(f"'{given[0]}' needs 'vehicle'")
        if given[0] != "request" and (self.arguments or self.answer != "accepted"):
            raise ValueError("'arguments' and 'answer' go with 'request'")
        if given[0] != "failure" and (self.parameters or self.for_s is not None):
            raise ValueError("'parameters' and 'for_s' go with 'failure'")
        if given[0] == "failure" and self.for_s is None:
            raise ValueError("'failure' needs 'for_s'")
        return self


class Limit(Section):
    """A limit that makes the verdict."""

    what: str
    vehicle: str | None = None
    vehicles: tuple[str, ...] | None = Field(default=None, min_length=1)
    from_s: Seconds = 0.0
    to_s: Span | None = None
    below: float | None = None
    above: float | None = None

    @model_validator(mode="after")
    def _is_one_limit(self) -> Self:
        if self.what not in QUANTITIES:
            with_unit = [name for name in QUANTITIES if name.startswith(self.what)]
            hint = f": a limit has a unit, '{with_unit[0]}'" if with_unit and self.what else ""
            raise ValueError(f"what: {shortened(self.what)!r} is none of {', '.join(QUANTITIES)}{hint}")
        if self.below is None and self.above is None:
            raise ValueError("give 'below' or 'above'")
        if (self.vehicle is None) == (self.vehicles is None):
            raise ValueError("give either 'vehicle' or 'vehicles'")
        if self.below is not None and self.below <= QUANTITIES[self.what].least:
            raise ValueError(f"below = {self.below:g} can never hold: {self.what} is never negative")
        if self.below is not None and self.above is not None and self.above >= self.below:
            raise ValueError(f"above = {self.above:g} and below = {self.below:g} can never both hold")
        if self.to_s is not None and self.to_s <= self.from_s:
            raise ValueError(f"from_s = {self.from_s:g} is not before to_s = {self.to_s:g}")
        return self


class Dispersion(Section):
    """How a value varies from run to run of a campaign: exactly one law.

    Attributes:
        normal, add_normal: Mean and standard deviation; in place of the value, or added to it.
        uniform, add_uniform: Lowest and highest.
        choice: One of these.
        common: Keys of one name draw one value.
    """

    normal: tuple[float, Annotated[float, Field(ge=0.0)]] | None = None
    uniform: tuple[float, float] | None = None
    add_normal: tuple[float, Annotated[float, Field(ge=0.0)]] | None = None
    add_uniform: tuple[float, float] | None = None
    choice: tuple[float | int | str | bool, ...] | None = Field(default=None, min_length=1)
    common: Name | None = None

    @model_validator(mode="after")
    def _is_one_law(self) -> Self:
        given = [name for name in self.laws() if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"give one of {', '.join(self.laws())}, found {given or 'none'}")
        for name in ("uniform", "add_uniform"):
            span = getattr(self, name)
            if span is not None and span[0] > span[1]:
                raise ValueError(f"{name}: {span[0]:g} is above {span[1]:g}")
        return self

    @staticmethod
    def laws() -> tuple[str, ...]:
        """Names of the laws."""
        return "normal", "uniform", "add_normal", "add_uniform", "choice"

    @property
    def law(self) -> str:
        """The one that is given."""
        return next(name for name in self.laws() if getattr(self, name) is not None)


class ScenarioFile(PlainModel):
    """A whole scenario file."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    name: Words
    rig: Annotated[str, Field(min_length=1)]
    duration_s: Span
    ready_s: Span = 60.0
    seed: Annotated[int, Field(ge=0, lt=2**63)] | None = None
    vehicles: dict[str, VehicleKeys] = Field(default_factory=dict)
    changes: dict[str, Any] = Field(default_factory=dict)
    obstacles: tuple[Obstacle, ...] = ()
    timeline: tuple[Row, ...] = ()
    limits: tuple[Limit, ...] = ()
    dispersions: dict[str, Dispersion] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _ends_in_time(self) -> Self:
        for number, row in enumerate(self.timeline):
            if row.at_s is not None and row.at_s > self.duration_s:
                raise ValueError(
                    f"timeline.{number}.at_s: {row.at_s:g} s lies behind the end, duration_s = "
                    f"{self.duration_s:g}"
                )
        for number, limit in enumerate(self.limits):
            latest = limit.from_s if limit.to_s is None else limit.to_s
            if latest > self.duration_s or limit.from_s >= self.duration_s:
                raise ValueError(
                    f"limits.{number}: its span ends behind the end, duration_s = {self.duration_s:g}"
                )
        return self


def is_scenario(content: dict[str, Any]) -> bool:
    """Whether the keys are those of a scenario: a rig file has no key ``rig``."""
    return "rig" in content


def content_of(text: str, path: Path) -> dict[str, Any]:
    """The keys of a scenario or rig file.

    Raises:
        UsageError: It is no TOML.
    """
    try:
        return toml_of(text, path)
    except FileError as error:
        raise UsageError(in_one_line(str(error))) from error


def parse_content(content: dict[str, Any], path: Path) -> ScenarioFile:
    """Check the keys of a scenario file.

    Raises:
        ScenarioError: One sentence with file and key.
    """
    try:
        return ScenarioFile.model_validate(content)
    except ValidationError as error:
        raise ScenarioError(f"{path}: {first_sentence(error)}") from error
