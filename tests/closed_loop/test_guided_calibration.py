"""The guided calibration leads itself through rest, turns and pushes on the emulator, in virtual time."""

import pytest

from groundstation.declarations.request import Ack, Request
from groundstation.launch import guided
from groundstation.parts.supervision.messages import Supervision
from groundstation.recording.info import RecordingInfo
from groundstation.recording.reader import Recording
from groundstation.recording.writer import Recorder
from groundstation.rig.plan import make_node
from groundstation.runners.make_runner import make_runner
from groundstation.runners.replay import ReplayRunner

LONGEST_S = 500
SCALE_ERROR = 0.006  # with twice as much the supervisor takes turns for a zero that moved, and lands
QUICK = (
    ("rate_hz = 1.5", "rate_hz = 5.0"),
    ("delay_s = 0.6", "delay_s = 0.1"),
)
CHANGES = (
    ('model = "published"', f'model = "published"\ngyro_scale_error = {SCALE_ERROR}'),
    *QUICK,
    ("bus_index = 0", "bus_index = 0\nstarts_by_itself = false"),
)


class LateGuideNode(guided.GuideNode):
    """Begins some time after the run."""

    def __init__(self, after_s, *arguments):
        super().__init__(*arguments)
        self._after_ns = round(after_s * 1e9)

    def receive(self, message, now_ns):
        return super().receive(message, now_ns) if now_ns >= self._after_ns else ()

    def tick(self, now_ns):
        return super().tick(now_ns) if now_ns >= self._after_ns else ()


@pytest.fixture
def lead(fly):
    """A flight that is led from a moment on: the flight, the guide, its node and its advice."""

    def begin(after_s=0.0, changes=CHANGES, author="test"):
        guide = guided.load_wizard("imu").begin(fly(changes=changes).rig, "alpha")
        advice = []
        node = LateGuideNode(after_s, "alpha", guide, advice.append, author)
        return fly(changes=changes, extra_nodes=[node]), guide, node, advice

    return begin


def fly_until(flight, is_so, longest_s=LONGEST_S):
    """Fly on until something is so."""
    while not is_so() and flight.runner.now_ns < longest_s * 1e9:
        flight.run(0.5)
    assert is_so()


@pytest.mark.slow
def test_the_sequence_ends_with_enough_data_and_the_emulators_constants(lead):
    flight, guide, node, advice = lead()
    fly_until(flight, lambda: node.is_done)
    assert not node.trouble
    assert {request.author for request in flight.of(Request)} == {"test"}
    assert all(ack.accepted for ack in flight.of(Ack))
    assert [request.action for request in flight.of(Request) if request.action != "go_to"] == ["land", "fly"]
    assert advice[-1].step is None
    assert set(guide.outcomes.values()) == {"enough data"}, guide.outcomes
    outcome = guide.outcome()
    found, verified = outcome.quantities, outcome.verification
    true = {"gyro_scale": 1.0 - 1.0 / (1.0 + SCALE_ERROR), "lever_x": 0.03151, "lever_y": -0.02122}
    for name, value in true.items():
        assert abs(found[name].value - value) < 4.0 * found[name].sigma, name
    assert found["gyro_scale"].sigma < 2e-3
    # the flight that was kept apart: what is left is the fixes' noise, and the rig's own scale does worse
    assert verified["nis"].value < 6.0
    assert verified["heading"].value < verified["heading_with_the_rigs_constants"].value
    assert verified["x"].value < 5e-3
    assert not outcome.warnings
    assert any(curve.x for picture in guide.pictures() for curve in picture.curves)


def test_begun_soon_after_the_run_it_rests_without_a_break_and_waits_until_the_vehicle_flies(lead):
    flight, _, node, advice = lead(6.0, changes=QUICK)
    fly_until(flight, lambda: any(each.step and each.step.name == "turn" for each in advice), 60.0)
    turn_ns = flight.runner.now_ns
    # while it rests nothing lifts it: it cannot slide into a corner
    rulings = flight.of(Supervision, start_s=8.0, stop_s=turn_ns * 1e-9 - 0.6)
    assert len(rulings) > 150
    assert not any(ruling.air_on for ruling in rulings)
    first = next(each for each in advice if each.step.name == "turn")
    assert guided.BY_ITSELF in first.note
    assert "waits until it flies: landed" in first.note
    fly_until(flight, lambda: not advice[-1].note, 90.0)
    assert flight.of(Supervision)[-1].mode == "flying"
    assert [row.action for row in flight.of(Request)] == ["land", "fly"]  # sent nowhere on the ground
    fly_until(flight, lambda: any(row.action == "go_to" for row in flight.of(Request)), 90.0)
    assert not node.is_done


def test_an_unknown_vehicle_is_not_calibrated(lead):
    flight, _, node, advice = lead(changes=(("delay_s = 0.6", "delay_s = 4.0"),))
    fly_until(flight, lambda: node.is_done, 10.0)
    assert node.trouble == "alpha is not known yet: no state is received."
    assert not advice
    assert not flight.of(Request)


def test_a_stopped_vehicle_is_not_calibrated(lead):
    flight, _, node, advice = lead(4.0)
    flight.run(3.0)
    flight.request("stop", author="anna")
    fly_until(flight, lambda: node.is_done, 10.0)
    assert node.trouble == "alpha is stopped by anna: release the stop first."
    assert not advice


@pytest.mark.parametrize("action", ["stop", "land", "brake"])
def test_who_stops_lands_or_brakes_the_vehicle_ends_the_calibration(lead, action):
    flight, _, node, advice = lead()
    fly_until(flight, lambda: any(row.action == "go_to" for row in flight.of(Request)), 90.0)
    assert not node.is_done
    flight.request(action, author="anna", request_id=70)
    flight.run(2.0)
    assert node.is_done
    assert "by anna" in node.trouble
    assert node.trouble.endswith("the calibration ends.")
    asked = len(flight.of(Request))
    flight.run(15.0)
    assert len(flight.of(Request)) == asked
    assert (
        flight.of(Supervision)[-1].mode == {"stop": "stopped", "land": "landed", "brake": "holding"}[action]
    )
    assert advice[-1].step.name == "turn"


def test_who_lifts_the_resting_vehicle_ends_the_calibration(lead):
    flight, _, node, _ = lead()
    flight.run(8.0)
    flight.request("float_on", author="anna", request_id=70)
    flight.run(2.0)
    assert node.trouble == "alpha is floating by anna (floats by request, unarmed): the calibration ends."


def test_a_refused_request_ends_its_step_and_is_not_repeated(lead):
    flight, guide, node, advice = lead()
    fly_until(flight, lambda: any(row.action == "go_to" for row in flight.of(Request)), 90.0)
    flight.request("take_control", author="anna", request_id=70)
    fly_until(flight, lambda: node.is_done, 150.0)
    refused = [ack for ack in flight.of(Ack) if not ack.accepted]
    assert [ack.action for ack in refused] == ["go_to"] * 3  # one each of turn, push and check
    assert guide.outcomes["rest"] == "enough data"
    for step in ("turn", "push", "check"):
        assert guide.outcomes[step].startswith("given up: go_to was refused: control is held by anna")
    assert advice[-1].step is None
    assert advice[-1].ended == f"check: {guide.outcomes['check']}"
    assert not node.trouble


def test_rest_is_what_is_without_a_break(lead):
    flight, _, node, advice = lead(author="")
    flight.run(15.0)
    before = advice[-1]
    assert before.step.is_rest
    flight.request("float_on", author="anna")
    flight.run(2.0)
    flight.request("land", author="anna", request_id=8)
    flight.run(5.0)
    assert advice[-1].step.is_rest
    assert advice[-1].done < before.done < 1.0
    assert not node.is_done  # who drives it himself may


def test_a_flight_that_is_led_replays_bit_for_bit(fly, tmp_path):
    path = tmp_path / "led.mcap"
    rig = fly(changes=CHANGES).rig
    guide = guided.load_wizard("imu").begin(rig, "alpha")
    node = guided.GuideNode("alpha", guide, lambda _: None, "test")
    asked = []

    def note(delivered, _):
        if isinstance(delivered.payload, Request):
            asked.append(delivered.payload.action)

    with Recorder(path, RecordingInfo()) as recorder:
        runner = make_runner(rig, 1, [recorder.record, note], extra_nodes=[node])
        while asked.count("go_to") < 2 and runner.now_ns < 90e9:
            runner.run(500_000_000)
        runner.close()
    assert asked[:3] == ["land", "fly", "go_to"]
    with Recording(path) as recording:
        report = ReplayRunner(recording, lambda key: make_node(rig, key)).run()
    assert report.agrees
    assert not report.missing_inputs
    nouns = {result.noun: result.equal for result in report.results}
    assert nouns["supervision"] > 300
    assert nouns["ack"] >= 4
