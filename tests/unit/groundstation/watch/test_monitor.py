"""The monitor: cheap while messages stream, right when somebody looks, unharmed by what fails."""

import sys

import pytest

from groundstation.declarations.part import Part
from groundstation.declarations.tables import Tables
from groundstation.declarations.view import Gauge, GaugeRow, cell
from groundstation.parts.control.messages import Wrench
from groundstation.parts.fusion.messages import FusionStatus, VehicleState
from groundstation.parts.imu.messages import Imu
from groundstation.parts.operation.messages import Diagnostics
from groundstation.parts.stars.messages import StarFix
from groundstation.parts.supervision.messages import Supervision
from groundstation.parts.valves.messages import CanIn, ValveCommand, ValveStatus
from groundstation.watch import monitor as monitor_module
from groundstation.watch import vehicle_monitor
from groundstation.watch.monitor import Monitor

SECOND_NS = 1_000_000_000


@pytest.fixture
def decoded(monkeypatch):
    """Classes of the payloads that were decoded, in order."""
    kinds = []
    real = monitor_module.codec_of

    def counted(kind):
        kinds.append(kind)
        return real(kind)

    monkeypatch.setattr(monitor_module, "codec_of", counted)
    monkeypatch.setattr(vehicle_monitor, "codec_of", counted)
    return kinds


def row(monitor, label, vehicle="alpha", now_ns=0):
    watched = monitor.vehicles[vehicle]
    return dict(zip(watched.labels(), watched.rows(now_ns), strict=True))[label].text


def test_only_the_newest_of_what_is_looked_at_is_decoded(tables, message, delivered, recorded, decoded):
    monitor = Monitor(tables, ("alpha", "beta"))
    for number in range(200):
        for kind in (Imu, FusionStatus, ValveCommand, ValveStatus):
            payload = message(
                kind, stamp_ns=number, **({"frames_lost": number, "valid": True} if kind is Imu else {})
            )
            monitor.take(recorded(delivered(payload, number)), number * 10_000_000)
    assert decoded == []
    assert row(monitor, "IMU", now_ns=2 * SECOND_NS).endswith("199 lost")
    assert sorted(kind.__name__ for kind in decoded) == ["FusionStatus", "Imu", "ValveCommand", "ValveStatus"]
    assert row(monitor, "IMU", now_ns=2 * SECOND_NS).endswith("199 lost")
    assert len(decoded) == 4  # nothing new came
    assert row(monitor, "IMU", vehicle="beta") == "-"


def test_what_nobody_shows_is_not_decoded_and_not_kept(tables, message, delivered, recorded, decoded):
    monitor = Monitor(tables, ("alpha",))
    monitor.take(recorded(delivered(message(Wrench))), 0)
    monitor.take(recorded(delivered(message(CanIn, ""))), 0)  # of no part here
    assert decoded == []
    assert monitor.vehicles["alpha"].undecoded == {}


def test_rates_count_what_is_not_decoded_and_fall_to_zero(tables, message, delivered, recorded):
    monitor = Monitor(tables, ("alpha",))
    for number in range(90):
        monitor.take(recorded(delivered(message(Imu), number)), number * 10_000_000)
    assert row(monitor, "IMU", now_ns=SECOND_NS).startswith("   30 /s")  # 90 in a window of 3 s
    assert row(monitor, "IMU", now_ns=9 * SECOND_NS).startswith("    0 /s")


def test_the_record_stream_shows_what_delivered_messages_show(tables, message, delivered, recorded):
    streamed, direct = Monitor(tables, ("alpha",)), Monitor(tables, ("alpha",))
    payloads = [
        message(Supervision, mode="flying", cause="it floats"),
        message(VehicleState, position_table_m=(1.0, 2.0), status="flying", fix_stamp_ns=3),
        message(FusionStatus, fixes_used=4, fix_age_s=0.2),
        message(StarFix, reason="too few stars: 1", stamp_ns=3),
        message(ValveCommand, gate="open"),
        message(Diagnostics, node="alpha/imu", level=2, summary="alpha/imu: gone"),
    ]
    for number, payload in enumerate(payloads, start=1):
        one = delivered(payload, number, 10 * number)
        streamed.take(recorded(one), number)
        direct.take_delivered(one, number)
    assert streamed.take_lines() == direct.take_lines() == ["alpha: flying (it floats)", "alpha/imu: gone"]
    assert streamed.vehicles["alpha"].rows(9) == direct.vehicles["alpha"].rows(9)
    assert streamed.vehicles["alpha"].line(9) == direct.vehicles["alpha"].line(9)
    assert streamed.summarise_latency(9)[0].p50_s[4] == pytest.approx(17e-9)  # the state
    assert direct.summarise_latency(9)[0].p50_s[4] == pytest.approx(17e-9)
    assert streamed.latency["alpha"].stages == direct.latency["alpha"].stages


def test_a_vehicle_is_known_once_something_of_its_own_came(tables, message, delivered, recorded):
    monitor = Monitor(tables, ("alpha", "beta"))
    monitor.take(
        recorded(delivered(message(Diagnostics, "", node="valve_bus", summary="valve_bus: open"))), 0
    )
    assert not monitor.vehicles["alpha"].is_known
    monitor.take(recorded(delivered(message(Imu))), 0)
    monitor.take(recorded(delivered(message(Imu, "gamma"))), 0)  # of another rig
    assert [watched.is_known for watched in monitor.vehicles.values()] == [True, False]


def test_ports_and_nodes_report_news_once(tables, message, delivered):
    monitor = Monitor(tables, ("alpha", "beta"))

    def report(node, level, summary, **more):
        payload = message(Diagnostics, "", node=node, level=level, summary=summary, **more)
        monitor.take_delivered(delivered(payload), 0)
        return monitor.take_lines()

    assert report("valve_bus", 2, "valve_bus: cannot be opened; next try in 1 s") != []
    assert report("valve_bus", 2, "valve_bus: cannot be opened; next try in 2 s") == []
    assert report("valve_bus", 0, "valve_bus: open") == ["valve_bus: open"]
    assert report("valve_bus", 0, "valve_bus: open") == ["valve_bus: open"]  # opened again
    counters = {"keys": ("a",), "values": ("1",)}
    assert report("alpha/fusion", 1, "alpha/fusion: no force", **counters) == ["alpha/fusion: no force"]
    assert report("alpha/fusion", 1, "alpha/fusion: no force", **counters) == []
    assert report("alpha/fusion", 0, "", **counters) == []
    assert set(monitor.health.ports) == {"valve_bus"}
    assert set(monitor.health.nodes) == {"alpha/fusion"}


def test_the_newest_events_are_kept_for_the_view(tables):
    monitor = Monitor(tables, ("alpha",))
    for number in range(20):
        monitor.note(str(number))
    assert list(monitor.lines) == [str(number) for number in range(12, 20)]
    assert len(monitor.take_lines()) == 20
    assert monitor.take_lines() == []


def test_garbled_messages_are_counted_and_reported_once_per_topic(tables, message, delivered, recorded):
    monitor = Monitor(tables, ("alpha",))
    monitor.take(recorded(delivered(message(Imu, frames_lost=5, valid=True))), 0)
    assert row(monitor, "IMU").endswith("5 lost")
    for kind in (Supervision, Supervision, Imu):
        one = recorded(delivered(message(kind)))
        monitor.take(one._replace(data=one.data[:-3]), 0)
    assert row(monitor, "IMU").endswith("5 lost")  # the value before stays
    assert monitor.undecodable == 3
    lines = monitor.take_lines()
    assert [line.partition(" cannot")[0] for line in lines] == [
        "a message on alpha/supervision",
        "a message on alpha/imu",
    ]


class Shared(Gauge):
    """Reports the same of a message for each vehicle, and fails on the modes ``fail`` and ``exit``."""

    label = "shared"
    every = (Diagnostics, Supervision)

    def take(self, message, now_ns):
        yield f"{message.node} reports" if isinstance(message, Diagnostics) else "a mode"
        if getattr(message, "mode", "") == "fail":
            raise RuntimeError("no such mode")
        if getattr(message, "mode", "") == "exit":
            sys.exit("enough")

    def cell(self, newest, now_ns):
        return cell("fine")


@pytest.fixture
def shared():
    part = Part("mine", "", topics=(Diagnostics, Supervision), gauges=(GaugeRow(5, Shared),))
    return Monitor(Tables((part,)), ("alpha", "beta"))


def test_what_all_vehicles_report_of_one_message_is_one_event(shared, message, delivered):
    shared.take_delivered(delivered(message(Diagnostics, "", node="rig")), 0)
    assert shared.take_lines() == ["rig reports"]
    shared.take_delivered(delivered(message(Diagnostics, "beta", node="beta/x")), 0)
    assert shared.take_lines() == ["beta/x reports"]


@pytest.mark.parametrize(
    ("mode", "how"), [("fail", "RuntimeError: no such mode"), ("exit", "SystemExit: enough")]
)
def test_a_gauge_that_fails_is_reported_once_and_harms_nothing(shared, message, delivered, mode, how):
    for number in range(3):
        shared.take_delivered(delivered(message(Supervision, mode=mode), number), 0)
    assert shared.take_lines() == [f"alpha: Shared failed: {how}"]
    assert row(shared, "shared") == "failed"
    assert row(shared, "shared", vehicle="beta") == "fine"
    shared.look(0)
    assert shared.vehicles["alpha"].line(0) == ""
