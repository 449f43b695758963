"""The screens that look on, and what each is sent; the heart of the server, without HTTP."""

import asyncio
import logging
from collections.abc import Callable, Mapping
from typing import Any

from groundstation.console.chart_tap import ChartTap, UnknownFieldError
from groundstation.console.client import Client, Socket
from groundstation.console.source import Source
from groundstation.console.state import rig_state
from groundstation.console.wire import chart_frame, json_frame, picture_frame
from groundstation.declarations.message import Message
from groundstation.parts.operation.messages import Diagnostics, Latency
from groundstation.parts.stars.messages import StarMatches, StarPicture
from groundstation.recording.errors import RecordingError

_LOG = logging.getLogger(__name__)
STEP_S = 0.05
HEALTH_STEPS, CHART_STEPS = 20, 2
MOST_FIELDS = 40


class Screen:
    """One screen.

    Args:
        socket: To it.
        may_command: It is an operator's.

    Attributes:
        client: Frames on their way.
        camera: Vehicle whose camera it shows; empty for none.
        tap: Of its charts; None for none.
        last_event: Number of the last that it was sent.
    """

    def __init__(self, socket: Socket, *, may_command: bool) -> None:
        self.client = Client(socket)
        self.may_command = may_command
        self.camera = ""
        self.picture_ns = 0
        self.tap: ChartTap | None = None
        self.last_event = 0
        self.sent_columns: set[str] = set()


class Hall:
    """Sends each screen what it shows, twenty times a second.

    Args:
        source: Of what is shown.
        payloads: Payload classes by noun.
    """

    def __init__(self, source: Source, payloads: Mapping[str, type[Message]]) -> None:
        self._source = source
        self._payloads = payloads
        self.screens: list[Screen] = []
        self.greetings: list[Callable[[], bytes]] = []
        self.now_ns = 0
        self._steps = 0
        self._counts: dict[tuple[str, str], int] = {}
        self._reading: set[asyncio.Task[None]] = set()

    @property
    def cameras(self) -> set[str]:
        """Vehicles whose pictures somebody looks at."""
        return {screen.camera for screen in self.screens if screen.camera}

    def enter(self, screen: Screen) -> None:
        """Begin to send to a screen."""
        self.screens.append(screen)
        hello = {"type": "rig", "rig": self._source.page, "may_command": screen.may_command}
        screen.client.append(json_frame(hello))
        for greeting in self.greetings:
            screen.client.append(greeting())
        self._send_events(screen)

    def tell(self, what: str, frame: bytes) -> None:
        """Send all screens a frame that replaces the one of the same name."""
        for screen in self.screens:
            screen.client.show(what, frame)

    def leave(self, screen: Screen) -> None:
        """End it."""
        self.show_charts(screen, ())
        self.screens.remove(screen)

    def show_charts(self, screen: Screen, names: tuple[str, ...]) -> None:
        """Let a screen have samples of these fields.

        Raises:
            UnknownFieldError: There is no such field, or they are too many.
        """
        if len(names) > MOST_FIELDS:
            raise UnknownFieldError(f"a screen can have {MOST_FIELDS} fields at once, asked for {len(names)}")
        tap = ChartTap(names, self._payloads) if names else None
        if screen.tap is not None:
            self._source.feed.untap(screen.tap)
        screen.tap = tap if self._source.page["kind"] == "live" else None
        if screen.tap is not None:
            self._source.feed.tap(screen.tap)
        elif names:
            task = asyncio.get_running_loop().create_task(self._send_columns(screen, names))
            self._reading.add(task)
            task.add_done_callback(self._reading.discard)

    async def _send_columns(self, screen: Screen, names: tuple[str, ...]) -> None:
        """Of a recording: each field once, whole; read beside the loop, since it takes a while."""
        for name in names:
            if name in screen.sent_columns:
                continue
            try:
                samples = await asyncio.to_thread(self._source.columns, (name,))
            except RecordingError as error:
                screen.client.append(json_frame({"type": "trouble", "text": str(error)}))
                return
            screen.sent_columns.add(name)
            if samples:
                screen.client.append(chart_frame(samples, is_whole=True))

    async def run(self) -> None:
        """Step until cancelled."""
        loop = asyncio.get_running_loop()
        due_s, trouble = loop.time(), ""
        while True:
            try:
                self.step()
            except Exception as error:  # nothing that cannot be read ends what all screens are sent
                if str(error) != trouble:
                    trouble = str(error)
                    _LOG.exception("what is shown cannot be read")
                    for screen in self.screens:
                        screen.client.append(json_frame({"type": "trouble", "text": trouble}))
            else:
                trouble = ""
            due_s = max(due_s + STEP_S, loop.time())
            await asyncio.sleep(due_s - loop.time())

    def look(self) -> dict[str, Any]:
        """The state as it is at this moment."""
        self.now_ns = self._source.step()
        return self.state()

    def step(self) -> None:
        """Take what has come, and show it."""
        self.now_ns = self._source.step()
        self._steps += 1
        if not self.screens:
            return
        shown = json_frame({"type": "state", **self.state()})
        health = json_frame(self._health()) if self._steps % HEALTH_STEPS == 0 else b""
        for screen in self.screens:
            screen.client.show("state", shown)
            if health:
                screen.client.show("health", health)
            self._send_events(screen)
            if screen.tap is not None and self._steps % CHART_STEPS == 0:
                samples = screen.tap.samples()
                if samples:
                    screen.client.append(chart_frame(samples))
            if screen.camera:
                self._send_picture(screen)

    def state(self) -> dict[str, Any]:
        """The newest of everything, as JSON can hold it."""
        return {**rig_state(self._source.feed, self._source.vehicles, self.now_ns), **self._source.extra()}

    def _send_events(self, screen: Screen) -> None:
        if screen.last_event == self._source.events.last:
            return
        events = self._source.events.since(screen.last_event)
        screen.last_event = self._source.events.last
        if events:
            screen.client.append(json_frame({"type": "events", "events": events}))

    def _send_picture(self, screen: Screen) -> None:
        feed = self._source.feed
        matches, picture = feed.get(StarMatches, screen.camera), feed.get(StarPicture, screen.camera)
        if matches is None or picture is None or matches.stamp_ns != picture.stamp_ns:
            return
        if picture.stamp_ns == screen.picture_ns:
            return
        screen.picture_ns = picture.stamp_ns
        screen.client.show(
            "picture", picture_frame(_picture_head(screen.camera, matches, picture), picture.data)
        )

    def _health(self) -> dict[str, Any]:
        """Nodes, rates, ages: once a second."""
        feed = self._source.feed
        seconds = HEALTH_STEPS * STEP_S
        rates = []
        for key, count in sorted(feed.counts.items()):
            rates.append([*key, round((count - self._counts.get(key, 0)) / seconds, 1)])
            self._counts[key] = count
        reports = [
            report
            for noun, owner in list(feed.newest)
            if noun == Diagnostics.TOPIC.noun and (report := feed.get(Diagnostics, owner)) is not None
        ]
        latency = {
            name: {"stages": row.stages, "p50_s": row.p50_s, "p99_s": row.p99_s}
            for name in self._source.vehicles
            if (row := feed.get(Latency, name)) is not None
        }
        return {
            "type": "health",
            "rates": rates,
            "nodes": [_report(report) for report in reports],
            "latency": latency,
            "refused": feed.refused,
        }


def _picture_head(vehicle: str, matches: StarMatches, picture: StarPicture) -> dict[str, Any]:
    spots = [
        [float(u), float(v), kind]
        for u, v, kind in zip(matches.u_px, matches.v_px, matches.kind, strict=False)
    ]
    stars = [
        [name, float(u), float(v), spot]
        for name, u, v, spot in zip(
            matches.stars, matches.star_u_px, matches.star_v_px, matches.spot_of_star, strict=False
        )
    ]
    return {
        "vehicle": vehicle,
        "t_s": picture.stamp_ns * 1e-9,
        "format": picture.format,
        "reason": matches.reason,
        "basis": matches.basis,
        "pose": [matches.x_m, matches.y_m, matches.heading_rad],
        "spots": spots,
        "stars": stars,
    }


def _report(report: Diagnostics) -> dict[str, Any]:
    return {
        "node": report.node,
        "level": report.level,
        "summary": report.summary,
        "values": dict(zip(report.keys, report.values, strict=False)),
        "t_s": report.stamp_ns * 1e-9,
    }
