"""The console over a recording: the same screens, with a time that a person moves."""

import asyncio
import time
from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from groundstation.console.access import Access
from groundstation.console.chart_tap import Samples, find_field
from groundstation.console.events import Event, Events
from groundstation.console.feed import Feed
from groundstation.console.recorded_columns import pose_at, samples_of, tracks_of
from groundstation.console.rig_page import rig_page
from groundstation.console.serving import serve, server_of
from groundstation.console.shown_console import Console
from groundstation.declarations.errors import UsageError
from groundstation.declarations.message import Message
from groundstation.declarations.rig import Rig
from groundstation.declarations.topic import Recorded as Keeping
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.stars.messages import StarFix
from groundstation.recording.columns import read_columns
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recorded, Recording
from groundstation.rig.provenance import recorded_rig

BEFORE_NS = 1_500_000_000
"""So far before a moment messages are read that a screen shows there; what comes rarely is in memory."""
MOST_STEP_S = 0.5
SLOWEST, FASTEST = 0.01, 100.0
MOST_EVENTS, MOST_SHOWN = 1_000_000, 4000
"""Of a recording; beyond the second a screen is told of no fix that was used."""
RARE_HZ = 1.0


class ReplaySource:
    """A recording, and where in it a person looks.

    Args:
        recording: Open for as long as this lives.
        rig: As it was recorded.
        other: A recording that is laid over it, from its beginning; None for none. It is read and closed.
    """

    def __init__(self, recording: Recording, rig: Rig, other: Recording | None = None) -> None:
        self._recording = recording
        self.tables = rig.tables
        self._payloads = rig.tables.payloads
        self.vehicles = tuple(rig.vehicles)
        self.feed = Feed(self._payloads)
        self._listening = Feed(self._payloads)
        self.events = Events(self._listening, MOST_EVENTS)
        self._first_ns = 0
        self._rare = self._read_rare()
        self._rare_ns = [message.log_ns for message in self._rare]
        self._all_events: list[Event] = list(self.events.kept)
        if len(self._all_events) > MOST_SHOWN:
            self.events.keep(lambda event: event["kind"] != "fix" or not event["used"])
        self._ghosts = {}
        if other is not None:
            with other:
                self._ghosts = tracks_of(other, self.vehicles)
        self._place_ns = recording.start_ns
        self._factor, self._is_playing, self._is_moved = 1.0, False, False
        self._looked_s = time.monotonic()
        self.page: dict[str, Any] = {
            **rig_page(rig),
            "kind": "replay",
            "replay": {
                "path": str(recording.path),
                "start_s": recording.start_ns * 1e-9,
                "duration_s": (recording.stop_ns - recording.start_ns) * 1e-9,
                "other": "" if other is None else other.path.name,
            },
        }
        self._seek(self._first_ns)

    @property
    def has_ghosts(self) -> bool:
        """Whether another recording has anything to be laid over this one."""
        return bool(self._ghosts)

    @property
    def place_s(self) -> float:
        """Where it is, from the beginning of the recording."""
        return (self._place_ns - self._recording.start_ns) * 1e-9

    def step(self) -> int:
        """Read where it was moved to; go on by the time since the last step, if it plays."""
        now_s = time.monotonic()
        passed_s, self._looked_s = min(now_s - self._looked_s, MOST_STEP_S), now_s
        is_moved, self._is_moved = self._is_moved, False
        until_ns = self._place_ns + round(passed_s * self._factor * 1e9)
        try:
            if is_moved:
                self._read_before()
            elif self._is_playing:
                self._read(self._place_ns + 1, until_ns)
        except RecordingError:
            self._is_playing = False  # a hole: it stays there, and can be moved past it
            raise
        if self._is_playing and not is_moved:
            self._place_ns = min(until_ns, self._recording.stop_ns)
            self._is_playing = self._place_ns < self._recording.stop_ns
        return self._place_ns

    def extra(self) -> dict[str, Any]:
        """Where it is; the vehicles of the other recording at the same time from its beginning."""
        found: dict[str, Any] = {
            "replay": {"t_s": self.place_s, "is_playing": self._is_playing, "factor": self._factor}
        }
        if self._ghosts:
            found["ghosts"] = {name: pose_at(track, self.place_s) for name, track in self._ghosts.items()}
        return found

    def control(self, asked: Mapping[str, Any]) -> None:
        """Do what a person asks for.

        Raises:
            ValueError: It is nothing that can be asked for.
        """
        what = asked.get("what")
        if what == "play":
            if self._place_ns >= self._recording.stop_ns:
                self._seek(self._recording.start_ns)
            self._is_playing = True
        elif what == "pause":
            self._is_playing = False
        elif what == "speed":
            self._factor = min(max(_number(asked, "factor"), SLOWEST), FASTEST)
        elif what == "seek":
            last_s = (self._recording.stop_ns - self._recording.start_ns) * 1e-9
            place_s = min(max(_number(asked, "t_s"), 0.0), last_s + 1.0)
            self._seek(self._recording.start_ns + round(place_s * 1e9))
        elif what in ("next_fault", "next_refused"):
            self._jump(what)
        else:
            raise ValueError(f"{what!r:.40} is nothing that a recording can do")

    def columns(self, names: Iterable[str]) -> dict[str, Samples]:
        """Whole columns of fields, for charts: times (s) and values; may be called from another thread.

        Raises:
            UnknownFieldError: There is no such field.
            RecordingError: The recording cannot be read.
        """
        fields = {name: find_field(name, self._payloads) for name in names}
        wanted: dict[type[Message], set[str]] = {}
        for field in fields.values():
            wanted.setdefault(self._payloads[field.noun], set()).add(field.name)
        with Recording(self._recording.path) as own:
            found = read_columns(own, wanted) if wanted else {}
        return {name: samples_of(found, field, self._payloads) for name, field in fields.items()}

    def close(self) -> None:
        self._recording.close()

    def _jump(self, what: str) -> None:
        """To shortly before the next fault or refused fix."""
        after_s = self._place_ns * 1e-9 + 0.25
        for event in self._all_events:
            is_wanted = (
                event["kind"] == "fault"
                if what == "next_fault"
                else event["kind"] == "fix" and not event["used"]
            )
            if is_wanted and event["t_s"] > after_s:
                self._seek(round(event["t_s"] * 1e9))
                return

    def _seek(self, place_ns: int) -> None:
        """Only move: a slider asks hundreds of times, and what it passed by need not be read."""
        self._place_ns = min(max(place_ns, self._recording.start_ns), self._recording.stop_ns)
        self._is_moved = True

    def _read_before(self) -> None:
        """Let all be known that a screen shows at this place."""
        self.feed.forget()
        for message in self._rare[: bisect_right(self._rare_ns, self._place_ns)]:
            self._take(message)
        self._read(self._place_ns - BEFORE_NS, self._place_ns)

    def _read(self, start_ns: int, stop_ns: int) -> None:
        """Take the messages of a span, its end included."""
        for message in self._recording.messages(self._kinds(), None, start_ns, stop_ns + 1):
            self._take(message)

    def _kinds(self) -> list[type[Message]]:
        return [kind for kind in self._payloads.values() if kind.TOPIC.recorded is not Keeping.IMAGES]

    def _take(self, message: Recorded) -> None:
        topic, owner = message.envelope.topic, message.envelope.owner
        self.feed.take_one((topic.noun, owner), message.data, message.log_ns)

    def _read_rare(self) -> list[Recorded]:
        """What comes seldom, and all that makes events: held in memory, a screen wants the last of it."""
        rare = [kind for kind in self._kinds() if kind.TOPIC.latched or kind.TOPIC.rate_hz < RARE_HZ]
        listened = [kind for kind in self._kinds() if self._listening.is_taken(kind)]
        found = []
        kinds = {*rare, *listened, VehicleState, StarFix} - {
            kind for kind in rare if kind.TOPIC.noun == "journal"
        }
        for message in self._recording.messages(list(kinds)):
            key = (message.envelope.topic.noun, message.envelope.owner)
            self._listening.take_one(key, message.data, message.log_ns)
            if key[0] == VehicleState.TOPIC.noun and not self._first_ns:
                self._first_ns = message.log_ns
            if self._payloads[key[0]] in rare:
                found.append(message)
        return found


def _number(asked: Mapping[str, Any], name: str) -> float:
    """A number of a wish; infinity stands for the end.

    Raises:
        ValueError: It is none.
    """
    given = asked.get(name)
    if isinstance(given, bool) or not isinstance(given, int | float) or given != given:
        raise ValueError(f"{name} is {given!r:.40}, expected a number")
    return float(min(max(given, -1e300), 1e300))


def look_at(path: Path, other: Path | None, access: Access, listening: Callable[[], None]) -> None:
    """Serve a recording until Ctrl-C.

    Args:
        path: The recording.
        other: Another one, laid over it; None for none.
        access: How it is reached.
        listening: Called once it is.

    Raises:
        RecordingError: It cannot be read.
        UsageError: The port is taken, or the other recording has no vehicle of this one.
    """
    with ExitStack() as opened:
        beside = (
            None if other is None else opened.enter_context(Recording(other))
        )  # a wrong one is noticed at once
        recording = opened.enter_context(Recording(path))
        rig = recorded_rig(recording)
        source = ReplaySource(recording, rig, beside)
        if beside is not None and not source.has_ghosts:
            raise UsageError(f"{other} has none of the vehicles of {path}: {', '.join(rig.vehicles)}")
        with suppress(KeyboardInterrupt):  # how a person ends it
            asyncio.run(serve(server_of(Console(source, rig.tables, access)), access.address, listening))
