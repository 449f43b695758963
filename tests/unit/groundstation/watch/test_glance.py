"""What a glance at a rig keeps: the newest of everything, SI, None for what is not known."""

import json
import math

import pytest

from groundstation.declarations.lease import Lease
from groundstation.parts.operation.messages import Diagnostics, Latency, RecorderStatus
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.parts.valves.messages import ValveStatus
from groundstation.watch.glance import OF_A_VEHICLE, OF_THE_RIG, Glance

S = 1_000_000_000


@pytest.fixture
def glance():
    return Glance(("alpha", "beta"))


@pytest.fixture
def look(glance, message, recorded, delivered):
    def take(kind, vehicle="alpha", **known):
        glance.take(recorded(delivered(message(kind, vehicle, **known))))

    return take


def test_nothing_known_is_none_and_goes_into_json(glance):
    seen = glance.as_dict(0)
    assert seen["vehicles"]["beta"]["mode"] is None
    assert (seen["recorder"], seen["control"]["holder"]) == (None, None)
    assert json.loads(json.dumps(seen, allow_nan=False)) == seen


def test_the_newest_counts(glance, look):
    look(Supervision, mode="armed")
    look(Supervision, mode="flying", cause="asked", author="anna", air_on=True, waits_for=("rest",))
    look(ValveStatus, floating=True, pressure_pa=1.2e7)
    seen = glance.as_dict(0)["vehicles"]["alpha"]
    assert (seen["mode"], seen["cause"], seen["author"]) == ("flying", "asked", "anna")
    assert (seen["air_on"], seen["air_ordered"], seen["pressure_pa"]) == (True, True, 1.2e7)
    assert seen["waits_for"] == ["rest"]


def test_what_is_not_finite_is_none(glance, look):
    look(ValveStatus, pressure_pa=math.nan)
    look(RecorderStatus, "", path="r.mcap", room_s=math.inf)
    look(Latency, stages=("bus",), p50_s=(math.nan,), p99_s=(0.03,))
    seen = glance.as_dict(0)
    assert seen["vehicles"]["alpha"]["pressure_pa"] is None
    assert seen["recorder"]["room_s"] is None
    assert seen["vehicles"]["alpha"]["latency_s"] == {"bus": {"p50": None, "p99": 0.03}}
    json.dumps(seen, allow_nan=False)


def test_a_recorder_that_writes_nothing_is_stopped_and_says_why(glance, look, recorded, delivered, message):
    look(RecorderStatus, "", path="r.mcap")
    assert (glance.as_dict(0)["recorder"]["is_stopped"], glance.as_dict(0)["recorder"]["trouble"]) == (
        False,
        "",
    )
    for level, is_stopped in ((1, False), (2, True)):
        health = message(Diagnostics, "", node="recorder", level=level, summary="r.mcap was deleted")
        glance.take(recorded(delivered(health))._replace(owner="recorder"))
        found = glance.as_dict(0)["recorder"]
        assert (found["is_stopped"], found["trouble"]) == (is_stopped, "r.mcap was deleted")


def test_faults_have_their_age_and_what_is_done(glance, look):
    look(
        Faults, ids=("dead_sky",), whats=("No fix.",), details=("7 s",), since_ns=(2.0 * S,),
        responses=("flies on",), advices=("Look up.",), gone_ns=(0.0,),
    )  # fmt: skip
    (fault,) = glance.as_dict(5 * S)["vehicles"]["alpha"]["faults"]
    assert (fault["id"], fault["since_s"], fault["is_gone"]) == ("dead_sky", 3.0, False)


def test_a_lease_that_has_expired_is_nobodys(glance, look):
    look(Lease, "", holder="anna", expires_ns=10 * S)
    assert glance.as_dict(4 * S)["control"] == {"holder": "anna", "expires_s": 6.0}
    assert glance.as_dict(10 * S)["control"] == {"holder": "", "expires_s": None}


def test_it_is_complete_once_there_is_something_of_everything(glance, look, recorded, delivered, message):
    kinds = [(kind, name) for kind in OF_A_VEHICLE for name in ("alpha", "beta")]
    kinds += [(kind, "") for kind in OF_THE_RIG]
    for kind, name in kinds:
        assert not glance.is_complete
        look(kind, name)
    assert not glance.is_complete
    health = recorded(delivered(message(Diagnostics, "", node="recorder")))
    glance.take(health._replace(owner="outside"))
    assert not glance.is_complete
    glance.take(health._replace(owner="recorder"))
    assert glance.is_complete


def test_bytes_that_do_not_fit_are_counted(glance, recorded, delivered, message):
    one = recorded(delivered(message(Supervision)))
    glance.take(one._replace(data=one.data[:9]))
    assert glance.undecodable == 1
