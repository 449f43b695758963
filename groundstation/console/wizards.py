"""Guided calibrations at the console: which there are, which one goes on, what becomes of its result."""

import asyncio
import hashlib
import json
import logging
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from groundstation.console.desk import Desk, NotAllowedError
from groundstation.console.feed import Feed
from groundstation.console.wire import json_frame, plain
from groundstation.console.wizard_session import Session, State
from groundstation.console.wizard_tap import WizardTap
from groundstation.declarations.errors import UsageError
from groundstation.declarations.guide import Wizard
from groundstation.declarations.request import Ack, ArgumentError, Request
from groundstation.declarations.rig import Rig
from groundstation.files.errors import FileError
from groundstation.files.writing import check_folder, write_files
from groundstation.launch.guided import load_wizard, wizard_names
from groundstation.parts.operation.messages import RecorderStatus

STEP_S = 0.2
FOLDER = Path("calibrations")
"""Beside the recording; where the run was started if nothing is recorded."""
_LOG = logging.getLogger(__name__)


class Wizards:
    """Leads one guided calibration at a time; the guide and its fit work in threads beside the event loop.

    Args:
        rig: Of the run.
        rig_text: Its file.
        rig_name: The file's name.
        feed: Where messages come from.
        desk: Where requests are made.
        holder: Who holds control now; empty for nobody, None while that is not known.
        tell: Sends a frame to all screens.
    """

    def __init__(
        self,
        rig: Rig,
        rig_text: str,
        rig_name: str,
        feed: Feed,
        desk: Desk,
        holder: Callable[[], str | None],
        tell: Callable[[str, bytes], None],
    ) -> None:
        self._rig, self._rig_name, self._feed, self._desk = rig, rig_name, feed, desk
        self._rig_sha256 = hashlib.sha256(rig_text.encode()).hexdigest()
        self._holder, self._tell = holder, tell
        self._wizards: dict[str, Wizard] = {}
        self._broken: dict[str, str] = {}
        self._session: Session | None = None
        self._tap: WizardTap | None = None
        self._answers: list[Ack] = []
        self._asking: set[asyncio.Task[None]] = set()
        self._changing = asyncio.Lock()

    def page(self) -> dict[str, Any]:
        """All that a screen shows of it, as JSON can hold it."""
        wizards = [
            {
                "name": name,
                "summary": wizard.summary,
                "missing": {vehicle: wizard.missing(self._rig, vehicle) for vehicle in self._rig.vehicles},
            }
            for name, wizard in self._wizards.items()
        ]
        session = None if self._session is None else self._session.page()
        shown: dict[str, Any] = plain({"wizards": wizards, "broken": self._broken, "session": session})
        return shown

    def frame(self) -> bytes:
        """The same for the WebSocket."""
        return json_frame({"type": "wizard", **self.page()})

    async def run(self) -> None:
        """Lead whatever was started, until cancelled."""
        self._wizards, self._broken = await asyncio.to_thread(_installed)
        self._show()
        while True:
            await asyncio.sleep(STEP_S)
            session = self._session
            if session is None or session.state not in (State.COLLECTING, State.FITTING):
                continue
            try:
                await self._go_on(session)
            except Exception as error:  # whatever somebody's guide raises
                _LOG.exception("the guided calibration %s failed", session.name)
                session.end(f"the guide failed: {error}.")
            if session is self._session:
                if session.state is not State.COLLECTING:
                    self._untap()
                self._show()

    def start(self, name: str, vehicle: str, author: str, *, is_driven: bool) -> None:
        """Begin one.

        Raises:
            ValueError: There is no such wizard or vehicle, or the rig lacks what it needs.
            NotAllowedError: Another one goes on.
        """
        wizard = self._wizards.get(name)
        if wizard is None:
            why = self._broken.get(name, f"there are {', '.join(self._wizards) or 'none'}")
            raise ValueError(f"there is no wizard {name!r:.40} ({why})")
        if vehicle not in self._rig.vehicles:
            raise ValueError(
                f"there is no vehicle {vehicle!r:.40} (there are {', '.join(self._rig.vehicles)})"
            )
        missing = wizard.missing(self._rig, vehicle)
        if missing:
            raise ValueError(f"{name} of {vehicle}: {missing}")
        on = self._session
        if on is not None and on.state not in (State.ENDED, State.SAVED):
            raise NotAllowedError(
                f"{on.name} of {on.vehicle} has not been accepted or discarded: one goes on at a time"
            )
        guide = wizard.begin(self._rig, vehicle)
        self._untap()
        self._session = Session(name, vehicle, guide, author, is_driven=is_driven)
        self._answers.clear()
        self._tap = WizardTap(guide.kinds, vehicle)
        self._feed.tap(self._tap)
        self._mark(f"{author} begins the guided calibration {name} of {vehicle}")
        self._show()

    async def accept(self, author: str) -> list[str]:
        """Write the result; the names of the files.

        Raises:
            NotAllowedError: There is no result, or it has been written.
            FileError: It cannot be written.
        """
        async with self._changing:
            session = self._session
            if session is None or session.found is None or session.state is not State.RESULT:
                raise NotAllowedError("there is no result to accept")
            written = await asyncio.to_thread(self._write, session)
            session.saved, session.state = written, State.SAVED
            self._mark(f"{author} accepts the calibration {session.name} of {session.vehicle}: {written[0]}")
            self._show()
            return list(written)

    def discard(self, author: str) -> None:
        """End it; nothing is written. The vehicle stays where it is.

        Raises:
            NotAllowedError: There is none.
        """
        session = self._session
        if session is None:
            raise NotAllowedError("there is no calibration to discard")
        self._session = None
        self._untap()
        if session.state is not State.SAVED:
            self._mark(f"{author} discards the calibration {session.name} of {session.vehicle}")
        self._show()

    async def _go_on(self, session: Session) -> None:
        if session.state is State.FITTING:
            await asyncio.to_thread(session.fit)
            return
        assert self._tap is not None
        holder = self._holder()
        if session.is_driven and holder != session.author:
            session.end(f"control is held by {holder or 'nobody'}: who drives a calibration has to hold it.")
            return
        messages, until_ns = self._tap.ready()
        answers, self._answers = self._answers, []
        for request in await asyncio.to_thread(session.go_on, messages, answers, until_ns):
            task = asyncio.create_task(self._ask(session, request))
            self._asking.add(task)
            task.add_done_callback(self._asking.discard)

    async def _ask(self, session: Session, request: Request) -> None:
        """Ask for what a guide wishes, in the name of who drives it; the answer comes with the next step."""
        try:
            given: Mapping[str, object] = json.loads(request.arguments)
            accepted, reason = await self._desk.request(
                request.vehicle, request.action, given, session.author
            )
        except (ArgumentError, NotAllowedError) as error:
            accepted, reason = False, str(error)
        if session is self._session:
            self._answers.append(
                Ack(
                    request.stamp_ns,
                    request.vehicle,
                    request.request_id,
                    request.author,
                    request.action,
                    accepted,
                    reason,
                )
            )

    def _write(self, session: Session) -> tuple[str, ...]:
        assert session.found is not None
        recorder = self._feed.get(RecorderStatus, "")
        folder = Path(recorder.path).parent / FOLDER if recorder is not None and recorder.path else FOLDER
        check_folder(folder)
        folder.mkdir(parents=True, exist_ok=True)
        now = datetime.now(UTC)
        stem = f"{session.vehicle}_{session.name}_{now:%Y%m%d_%H%M%S}"
        source = f"live, rig {self._rig_name}" + (f", {Path(recorder.path).name}" if recorder else "")
        contents = session.found.written(folder / f"{stem}.toml", source, self._rig_sha256, now)
        there = [str(path) for path in contents if path.exists()]
        if there:
            raise FileError(f"{there[0]} is there already: nothing is overwritten.")
        write_files(contents)
        return tuple(str(path.resolve()) for path in contents)

    def _untap(self) -> None:
        if self._tap is not None:
            self._feed.untap(self._tap)
            self._tap = None

    def _mark(self, text: str) -> None:
        try:
            self._desk.mark(text)
        except ArgumentError:
            _LOG.warning("this note is too long for the recording: %s", text)

    def _show(self) -> None:
        self._tell("wizard", self.frame())


def _installed() -> tuple[dict[str, Wizard], dict[str, str]]:
    """All that can be loaded, and why others cannot, by name."""
    wizards: dict[str, Wizard] = {}
    broken: dict[str, str] = {}
    for name in wizard_names():
        try:
            wizards[name] = load_wizard(name)
        except UsageError as error:
            broken[name] = str(error)
    return wizards, broken


def asked_of(body: Mapping[str, Any]) -> str:
    """What is asked for.

    Raises:
        ValueError: It is nothing that can be.
    """
    action = body.get("action")
    if not isinstance(action, str) or action not in ("start", "accept", "discard"):
        raise ValueError(f"action is {action!r:.40}, expected start, accept or discard")
    return action
