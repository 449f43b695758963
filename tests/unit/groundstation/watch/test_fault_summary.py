"""What is printed at the end of a run, live and in lockstep, and what the report states."""

import numpy as np

from groundstation.bus.cdr import codec_of
from groundstation.bus.cdr_columns import columns_of
from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.record_stream import RecordWriter, read_batch
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.supervision.figures import SupervisionFigure
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.watch.fault_summary import MOST_SHOWN, FaultSummary

BEGAN_NS = 5_000_000_000
SECOND_NS = 1_000_000_000


def faults(t_s, *ids, there=True):
    every = len(ids)
    gone_ns = 0.0 if there else BEGAN_NS + t_s * SECOND_NS
    return Faults(
        BEGAN_NS + round(t_s * SECOND_NS), "alpha", ids, ("",) * every, ("0.2 s old",) * every,
        (0.0,) * every, ("brakes, then lands",) * every, ("",) * every, (gone_ns,) * every,
    )  # fmt: skip


def ruling(t_s, mode, author=""):
    now_ns = BEGAN_NS + round(t_s * SECOND_NS)
    return Supervision(
        now_ns, "alpha", mode, "closed", False, False, False, 0.0, False, 0, f"{mode} for a reason", author,
        now_ns, (), (),
    )  # fmt: skip


FLIGHT = (
    ruling(0.0, "flying"),
    faults(1.0, "imu_silent"),
    faults(2.5, "imu_silent", there=False),
    ruling(3.0, "landing"),
    faults(4.0, "star_outage"),
)


def summary_of(*messages):
    summary = FaultSummary(("alpha", "beta"), BEGAN_NS)
    for number, message in enumerate(messages, 1):
        envelope = Envelope(type(message).TOPIC, message.vehicle, number, message.stamp_ns)
        summary.take_delivered(Delivered(envelope, message), message.stamp_ns)
    return summary


def test_faults_are_listed_by_vehicle_with_times_and_response():
    summary = summary_of(*FLIGHT)
    assert list(summary.lines()) == [
        "alpha: fault imu_silent from 1.0 s for 1.5 s (0.2 s old): brakes, then lands",
        "alpha: fault star_outage from 4.0 s to the end (0.2 s old): brakes, then lands",
        "alpha: LANDED BY A FAULT: landing for a reason",
    ]
    assert summary.brought_down == {"alpha": "landing for a reason"}


def test_a_quiet_run_says_nothing():
    summary = summary_of(ruling(0.0, "flying"), ruling(1.0, "landing", "anna"))
    assert list(summary.lines()) == []
    assert summary.brought_down == {}


def test_the_list_is_short():
    summary = summary_of(faults(1.0, *(f"fault_{number}" for number in range(MOST_SHOWN + 3))))
    lines = list(summary.lines())
    assert len(lines) == MOST_SHOWN + 1
    assert lines[-1] == "alpha: and 3 more faults; groundstation report names them"


def test_what_comes_in_the_record_stream_counts_alike():
    writer = RecordWriter()
    for number, message in enumerate(FLIGHT, 1):
        envelope = Envelope(type(message).TOPIC, message.vehicle, number, message.stamp_ns)
        writer.add(envelope, codec_of(type(message)).encode(message))
    writer.add(Envelope(Faults.TOPIC, "alpha", 9, 0), b"torn")
    writer.add(Envelope(Faults.TOPIC, "gamma", 9, 0), b"of nobody here")
    summary = FaultSummary(("alpha", "beta"), BEGAN_NS)
    for entry in read_batch(writer.take()):
        summary.take(entry)
    assert list(summary.lines()) == list(summary_of(*FLIGHT).lines())


def test_the_report_has_faults_closures_and_time_without_a_state():
    figure = SupervisionFigure()
    for message in FLIGHT:
        if not isinstance(message, VehicleState):
            figure.take(message, (message.stamp_ns - BEGAN_NS) * 1e-9)
    states = [message for message in FLIGHT if isinstance(message, VehicleState)]
    fields = {name: columns_of(states, [name])[name] for name in figure.columns[VehicleState]}
    t_s = np.array([state.stamp_ns - BEGAN_NS for state in states]) * 1e-9
    figure.take_columns(VehicleState, t_s, fields)
    assert figure.values() == {
        "faults": [
            {"id": "imu_silent", "since_s": 1.0, "until_s": 2.5, "detail": "0.2 s old",
             "response": "brakes, then lands"},
            {"id": "star_outage", "since_s": 4.0, "until_s": None, "detail": "0.2 s old",
             "response": "brakes, then lands"},
        ],
        "closures": 0,
        "time_without_state_s": 3.0,
        "landed_by_fault": "landing for a reason",
    }  # fmt: skip
