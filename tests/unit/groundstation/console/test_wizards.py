"""Guided calibrations of the console: from the record stream to a file, or to none."""

import asyncio
import json
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor

import pytest
from oracles.hand_fed_console import batch_of, state_of
from oracles.slow_guide import MeanWizard
from oracles.wizard_console import GrantingDesk

from groundstation.console import wizard_session
from groundstation.console import wizards as module
from groundstation.console.desk import NotAllowedError
from groundstation.console.wizard_session import Session, State
from groundstation.console.wizard_tap import HOLD_NS, WizardTap
from groundstation.console.wizards import Wizards, asked_of
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.operation.messages import RecorderStatus


@pytest.fixture
def desk(feed):
    return GrantingDesk(feed)


@pytest.fixture
def wizard(monkeypatch):
    wizard = MeanWizard(20)
    monkeypatch.setattr(wizard_session, "ADVICE_PERIOD_NS", 100_000_000)
    monkeypatch.setattr(module, "wizard_names", lambda: ("mean",))
    monkeypatch.setattr(module, "load_wizard", lambda name: wizard)
    return wizard


@pytest.fixture
def frames():
    return []


@pytest.fixture
def lead(rig, feed, desk, wizard, frames, tmp_path):
    """Wizards whose run lasts for as long as a coroutine of the test does."""

    def begin(test, holder=lambda: "anna"):
        feed.take_one(
            ("recorder_status", ""),
            _encoded(RecorderStatus(1, "", str(tmp_path / "run.mcap"), 5, 10**9, 1e4)),
            time.monotonic_ns(),
        )

        async def led():
            wizards = Wizards(
                rig, "text", "two.toml", feed, desk, holder, lambda what, frame: frames.append(frame)
            )
            running = asyncio.create_task(wizards.run())
            while b'"mean"' not in wizards.frame():
                await asyncio.sleep(0.01)
            try:
                await test(wizards)
            finally:
                running.cancel()

        # a thread of its own: a browser's test may have left a loop in this one
        with ThreadPoolExecutor(1) as pool:
            pool.submit(lambda: asyncio.run(asyncio.wait_for(led(), 60.0))).result()

    return begin


def _encoded(message):
    from groundstation.bus.cdr import codec_of

    return codec_of(type(message)).encode(message)


def session_of(wizards):
    return json.loads(wizards.frame()[1:])["session"]


async def until(wizards, state, feed, x_m=0.25):
    """Feed states until a session has come so far."""
    while (session := session_of(wizards))["state"] != state:
        assert session["state"] in ("collecting", "fitting"), session["trouble"]
        now_ns = time.monotonic_ns()
        states = [state_of("alpha", now_ns - HOLD_NS - 1000 * k, x_m) for k in range(4)]
        feed.take_batch(batch_of(states), now_ns)
        await asyncio.sleep(0.05)


def test_batches_of_two_processes_are_put_in_the_order_of_their_stamps(feed):
    tap = WizardTap((VehicleState,), "alpha")
    feed.tap(tap)
    now_ns = time.monotonic_ns()
    early, late = now_ns - 900_000_000, now_ns - 800_000_000
    feed.take_batch(batch_of([state_of("alpha", late), state_of("beta", late)]), now_ns)
    feed.take_batch(batch_of([state_of("alpha", early), state_of("alpha", now_ns + 10**9)]), now_ns)
    found, until_ns = tap.ready()
    assert [message.stamp_ns for message in found] == [early, late]  # not beta's, not what is too new
    assert all(message.stamp_ns <= until_ns for message in found)
    assert not tap.ready()[0]


def test_accepted_it_is_written_with_its_provenance_and_what_judged_it(lead, feed, desk, tmp_path):
    async def test(wizards):
        wizards.start("mean", "alpha", "anna", is_driven=False)
        await until(wizards, "result", feed)
        page = session_of(wizards)
        assert page["result"]["quantities"] == [["mean", 0.25, None, "m"]]
        assert page["result"]["verification"][0][:2] == ["off", 0.0]
        assert page["result"]["drawings"][0]["curves"][0]["y"][0] == 0.25
        assert "collect: enough data" in page["lines"]
        assert not (tmp_path / "calibrations").exists()
        files = await wizards.accept("anna")
        assert session_of(wizards)["state"] == "saved"
        assert [name.rpartition(".")[2] for name in files] == ["toml", "csv"]
        written = tomllib.loads((tmp_path / "calibrations" / files[0].rpartition("/")[2]).read_text())
        assert written["recording"] == "live, rig two.toml, run.mcap"
        assert written["mean"]["value"] == 0.25
        assert written["verification"]["off"]["value"] == 0.0
        assert written["verified_by"].endswith("states more")
        with pytest.raises(NotAllowedError):
            await wizards.accept("anna")
        assert desk.marks[-1].startswith("anna accepts the calibration mean of alpha")

    lead(test)
    assert not desk.asked  # it was not driven


def test_discarded_nothing_is_written_and_the_next_may_begin(lead, feed, tmp_path):
    async def test(wizards):
        wizards.start("mean", "alpha", "anna", is_driven=False)
        with pytest.raises(NotAllowedError, match="one goes on at a time"):
            wizards.start("mean", "alpha", "anna", is_driven=False)
        await until(wizards, "result", feed)
        wizards.discard("anna")
        assert session_of(wizards) is None
        wizards.start("mean", "alpha", "anna", is_driven=False)

    lead(test)
    assert not list(tmp_path.glob("**/*.toml"))


def test_driven_the_vehicle_is_asked_in_the_holders_name_and_the_answer_reaches_the_guide(
    lead, feed, desk, wizard
):
    async def test(wizards):
        desk.answer = (False, "it is stopped")
        wizards.start("mean", "alpha", "anna", is_driven=True)
        await until(wizards, "result", feed)

    lead(test)
    assert desk.asked == [("alpha", "land", {}, "anna")]
    assert wizard.guides[0].answers == [("land", "it is stopped")]


def test_who_loses_control_drives_no_longer(lead, feed):
    holder = ["anna"]

    async def test(wizards):
        wizards.start("mean", "alpha", "anna", is_driven=True)
        holder[0] = "bert"
        await until(wizards, "ended", feed)
        assert session_of(wizards)["trouble"].startswith("control is held by bert")

    lead(test, lambda: holder[0])


def test_data_that_give_no_result_are_a_sentence(lead, feed):
    async def test(wizards):
        wizards.start("mean", "alpha", "anna", is_driven=False)
        await until(wizards, "collecting", feed, 0.0)
        for x_m in (0.0, 5.0):
            now_ns = time.monotonic_ns()
            feed.take_batch(batch_of([state_of("alpha", now_ns - HOLD_NS, x_m)]), now_ns)
        await until(wizards, "ended", feed, 0.0)
        assert session_of(wizards)["trouble"] == "it moved."

    lead(test)


@pytest.mark.parametrize(
    ("name", "vehicle", "words"),
    [("mean", "beta", "only alpha stands"), ("mean", "nobody", "no vehicle"), ("mode", "alpha", "no wizard")],
)
def test_what_cannot_be_calibrated_is_refused_at_once(lead, name, vehicle, words):
    async def test(wizards):
        with pytest.raises(ValueError, match=words):
            wizards.start(name, vehicle, "anna", is_driven=False)
        assert session_of(wizards) is None

    lead(test)


def test_nothing_is_overwritten(rig, wizard, tmp_path):
    guide = wizard.begin(rig, "alpha")
    session = Session("mean", "alpha", guide, "anna", is_driven=False)
    guide.taken = [0.25] * 40
    session.fit()
    assert session.state is State.RESULT
    assert session.page()["result"]["title"] == "Mean"


def test_what_is_asked_for_is_start_accept_or_discard():
    assert asked_of({"action": "start"}) == "start"
    with pytest.raises(ValueError, match="expected start, accept or discard"):
        asked_of({"action": "stop"})
