"""Keys that a scenario adds to its rig: the timeline as its player carries it out.

Nobody writes them by hand: ``groundstation.scenario`` does, from a scenario file that it has checked. They
stand in the rig so that a recording holds all that is needed to replay the run.
"""

from pydantic import Field

from groundstation.declarations.rig_file import RigFile
from groundstation.declarations.section import NonNegative, Positive, Section


class TimelineRow(Section):
    """One row of the timeline, groups and degrees resolved.

    Attributes:
        where: The row's key in the scenario file, for sentences.
        at_s: When it is due; None for a row that waits.
        when: Condition that it waits for, from the moment the row above was carried out.
        timeout_s: So long; None for a row that is due at a time.
        after_s: Delay once the condition holds.
        vehicles: Whom it concerns.
        action: Requested of each of them; empty for a marker.
        arguments: JSON object.
        answer: ``accepted``, ``refused`` or ``any``: another one fails the run.
        mark: Text of a marker.
    """

    where: str
    at_s: NonNegative | None = None
    when: str = ""
    timeout_s: Positive | None = None
    after_s: NonNegative = 0.0
    vehicles: tuple[str, ...] = ()
    action: str = ""
    arguments: str = "{}"
    answer: str = "accepted"
    mark: str = ""


class ScenarioSection(Section):
    """A timeline and what begins and ends it.

    Attributes:
        name: Of the scenario.
        ready_s: The vehicles fly by then, or the run has failed.
        duration_s: From t = 0.
        starters: Vehicles that t = 0 waits for.
        by_hand: t = 0 also waits for a person's ``start_scenario``.
        settle_first: t = 0 also waits until they have settled at their starts.
        resumed: Vehicles whose controllers begin their own programs at t = 0.
        timeline: The rows.
    """

    name: str
    ready_s: Positive
    duration_s: Positive
    starters: tuple[str, ...]
    by_hand: bool = False
    settle_first: bool = False
    resumed: tuple[str, ...] = ()
    timeline: tuple[TimelineRow, ...] = ()


class ScenarioOfRig(Section):
    """Keys of the rig.

    Attributes:
        scenario: The timeline, where a scenario is flown.
        twin: Rig file of the emulated twin of real hardware: scenarios fly there first.
    """

    scenario: ScenarioSection | None = Field(default=None)
    twin: RigFile | None = None
