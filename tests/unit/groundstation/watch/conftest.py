"""Messages of which a test names only what it is about, and the parts' gauges without their nodes."""

import numpy as np
import pytest

from groundstation.bus.cdr import codec_of, ros_fields
from groundstation.bus.envelope import Cause, Delivered, Envelope
from groundstation.bus.record_stream import Recorded
from groundstation.declarations.part import Part
from groundstation.declarations.request import Ack, Request
from groundstation.declarations.tables import Tables
from groundstation.declarations.topic import Scope
from groundstation.parts.control import gauges as control
from groundstation.parts.control.messages import ControlStatus, Wrench
from groundstation.parts.fusion import gauges as fusion
from groundstation.parts.fusion.messages import FixAccount, FusionStatus, VehicleState
from groundstation.parts.imu import gauges as imu
from groundstation.parts.imu.messages import Imu, ImuBytes
from groundstation.parts.operation.messages import Diagnostics, Latency
from groundstation.parts.overhead import gauges as overhead
from groundstation.parts.overhead.messages import FixComparison
from groundstation.parts.reference import gauges as reference
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.stars import gauges as stars
from groundstation.parts.stars.messages import SkyChange, StarFix, StarSpots
from groundstation.parts.supervision import gauges as supervision
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.parts.valves import gauges as valves
from groundstation.parts.valves import messages as v

_VALVES = (v.Outlook, v.ValveStatus, v.ValveDemand, v.ValveSelection, v.ValveCommand, v.CanOut)
_ZEROS = {"string": "", "bool": False, "uint8[]": b"", "float32[]": np.empty(0, np.float32)}


def _message(kind, vehicle="alpha", stamp_ns=0, **known):
    """A message of a class; fields that are not named are zero or empty."""
    values = [known.pop(name) if name in known else _zero(ros) for name, ros in ros_fields(kind)]
    assert not known, f"{kind.__name__} has no {known}"
    return kind(stamp_ns, vehicle, *values)


def _zero(ros):
    if ros in _ZEROS:
        return _ZEROS[ros]
    if ros == "string[]":
        return ()
    if ros.endswith("]"):
        length = ros.partition("[")[2].rstrip("]")
        return (0.0,) * int(length or 0)
    return 0.0 if ros.startswith("float") else 0


def _delivered(payload, sequence=1, publish_ns=0, trigger=None):
    topic = type(payload).TOPIC
    owner = "flight" if topic.scope is Scope.PROCESS else payload.vehicle
    return Delivered(Envelope(topic, owner, sequence, publish_ns, trigger=trigger), payload)


def _recorded(one):
    """The same message as it comes in a record stream."""
    envelope, payload = one
    data = codec_of(type(payload)).encode(payload)
    return Recorded(
        envelope.topic.noun,
        envelope.owner,
        envelope.sequence,
        envelope.publish_ns,
        0,
        envelope.trigger,
        data,
    )


def _cause(one):
    """What names this message as a cause."""
    return Cause(one.envelope.topic.noun, one.envelope.owner, one.envelope.sequence)


@pytest.fixture(scope="session")
def tables():
    """All parts that show something, in the order of the tree, without nodes and sections."""
    return Tables(
        (
            Part("valves", "", topics=_VALVES, gauges=valves.GAUGES),
            Part("imu", "", topics=(ImuBytes, Imu), gauges=imu.GAUGES, figures=(imu.ImuFigure,)),
            Part("stars", "", topics=(StarSpots, StarFix, SkyChange), gauges=stars.GAUGES),
            Part(
                "overhead",
                "",
                topics=(FixComparison,),
                gauges=overhead.GAUGES,
                figures=(overhead.ComparisonFigure,),
            ),
            Part(
                "fusion",
                "",
                topics=(VehicleState, FixAccount, FusionStatus),
                gauges=fusion.GAUGES,
                figures=fusion.FIGURES,
            ),
            Part(
                "control",
                "",
                topics=(Wrench, ControlStatus),
                gauges=control.GAUGES,
                figures=(control.StationFigure,),
            ),
            Part(
                "operation",
                "",
                topics=(Request, Ack, Diagnostics, Latency),
            ),
            Part("supervision", "", topics=(Supervision, Faults), gauges=supervision.GAUGES),
            Part(
                "reference",
                "",
                topics=(ReferenceState,),
                gauges=reference.GAUGES,
                figures=(reference.EstimateFigure,),
            ),
        )
    )


@pytest.fixture(scope="session")
def message():
    return _message


@pytest.fixture(scope="session")
def delivered():
    return _delivered


@pytest.fixture(scope="session")
def recorded():
    return _recorded


@pytest.fixture(scope="session")
def cause():
    return _cause
