"""THE TABLE of topics: one row each, one payload class per topic, one publisher per vehicle.

From a row follow the bus key, the recorder's channel, liveness (silent for ten periods), the queue
policy of heavy consumers and the priority on the wire.
"""

from dataclasses import dataclass
from enum import Enum, auto

from groundstation.messages import definitions as m
from groundstation.messages.base import Message
from groundstation.messages.cdr import Codec


class Scope(Enum):
    """Whose a topic is."""

    VEHICLE = auto()
    RIG = auto()
    PROCESS = auto()


class Delivery(Enum):
    """What may be lost on the way."""

    EVERY = auto()  # nothing: the publisher waits
    NEWEST = auto()  # a slow consumer sees only the newest


class Recorded(Enum):
    """Whether the recorder keeps it."""

    ALWAYS = auto()
    IMAGES = auto()  # by the rig's image policy


@dataclass(frozen=True, slots=True)
class Topic:
    """One row.

    Attributes:
        index: Place in the table, breaks ties of equal stamps.
        noun: Last part of the bus key.
        payload: Class of the payload.
        rate_hz: Nominal rate, 0 where it comes by event.
        scope: Per vehicle, per rig or per process.
        delivery: Queue policy.
        latched: The last value reaches late joiners.
        observers_only: Only view, recorder and report may subscribe.
        recorded: Recording policy.
    """

    index: int
    noun: str
    payload: type[Message]
    rate_hz: float
    scope: Scope = Scope.VEHICLE
    delivery: Delivery = Delivery.EVERY
    latched: bool = False
    observers_only: bool = False
    recorded: Recorded = Recorded.ALWAYS

    @property
    def codec(self) -> Codec[Message]:
        """The compiled codec of the payload."""
        return _CODECS[self.payload]


def _row(
    noun: str,
    payload: type[Message],
    rate_hz: float,
    *,
    scope: Scope = Scope.VEHICLE,
    delivery: Delivery = Delivery.EVERY,
    latched: bool = False,
    observers_only: bool = False,
    recorded: Recorded = Recorded.ALWAYS,
) -> tuple[str, type[Message], float, Scope, Delivery, bool, bool, Recorded]:
    return noun, payload, rate_hz, scope, delivery, latched, observers_only, recorded


_ROWS = (
    # what must be judged first at equal stamps stands first: requests and valves before sensors
    _row("request", m.Request, 0, scope=Scope.PROCESS),
    _row("ack", m.Ack, 0, scope=Scope.PROCESS),
    _row("can_in", m.CanIn, 100, scope=Scope.RIG),
    _row("valve_status", m.ValveStatus, 50),
    _row("vehicle_mode", m.VehicleMode, 0, latched=True),
    _row("imu_bytes", m.ImuBytes, 100),
    _row("imu_raw", m.ImuRaw, 100),
    _row("imu", m.Imu, 100),
    _row("fix_bytes", m.FixBytes, 0),
    _row("star_image", m.StarImage, 15, delivery=Delivery.NEWEST, recorded=Recorded.IMAGES),
    _row("star_spots", m.StarSpots, 15),
    _row("star_fix", m.StarFix, 15),
    _row(
        "overhead_image",
        m.OverheadImage,
        10,
        scope=Scope.RIG,
        delivery=Delivery.NEWEST,
        recorded=Recorded.IMAGES,
    ),
    _row("overhead_fix", m.OverheadFix, 10),
    _row("state", m.VehicleState, 100),
    _row("fix_account", m.FixAccount, 15),
    _row("fusion_status", m.FusionStatus, 5),
    _row("wrench", m.Wrench, 20),
    _row("control_status", m.ControlStatus, 5),
    _row("valve_demand", m.ValveDemand, 20),
    _row("valve_selection", m.ValveSelection, 50),
    _row("valve_command", m.ValveCommand, 50),
    _row("can_out", m.CanOut, 50),
    _row("imu_order", m.ImuOrder, 0),
    _row("sequence_phase", m.SequencePhase, 0, latched=True),
    _row("reference_bytes", m.ReferenceBytes, 100, observers_only=True),
    _row("reference", m.ReferenceState, 100, observers_only=True),
    _row("fix_comparison", m.FixComparison, 1.5),
    _row("sky_change", m.SkyChange, 0),
    _row("star_matches", m.StarMatches, 0),
    _row("star_picture", m.StarPicture, 0),
    _row("calibration", m.CalibrationInUse, 0, latched=True),
    _row("fusion_calibration", m.FusionCalibration, 0, latched=True),
    _row("diagnostics", m.Diagnostics, 1, scope=Scope.PROCESS),
    _row("journal", m.Journal, 10, scope=Scope.PROCESS),
    _row("latency", m.Latency, 1, observers_only=True),
)

TOPICS: tuple[Topic, ...] = tuple(
    Topic(index, noun, payload, rate, scope, delivery, latched, observers_only, recorded)
    for index, (noun, payload, rate, scope, delivery, latched, observers_only, recorded) in enumerate(_ROWS)
)
_CODECS: dict[type[Message], Codec[Message]] = {row.payload: Codec(row.payload) for row in TOPICS}
_BY_PAYLOAD: dict[type[Message], Topic] = {row.payload: row for row in TOPICS}
_BY_NOUN: dict[str, Topic] = {row.noun: row for row in TOPICS}


def topic_of(payload: type[Message]) -> Topic:
    """The row of a payload class; KeyError for a class that has none."""
    return _BY_PAYLOAD[payload]


def topic_named(noun: str) -> Topic:
    """The row of a noun; KeyError for a noun that has none."""
    return _BY_NOUN[noun]
