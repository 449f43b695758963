"""A console that is served without a flight: states are fed by hand, the desk grants everything."""

import asyncio
import threading
import time
from pathlib import Path

import uvicorn

from groundstation.bus.cdr import codec_of
from groundstation.console.access import Access
from groundstation.console.feed import Feed
from groundstation.console.server import make_app
from groundstation.console.shown_console import Console
from groundstation.console.tokens import Tokens
from groundstation.console.wizard_tap import HOLD_NS
from groundstation.console.wizards import Wizards
from groundstation.declarations.lease import Lease
from groundstation.declarations.rig import Rig
from groundstation.parts.operation.messages import RecorderStatus
from groundstation.parts.table import own_tables
from oracles.hand_fed_console import HandSource, batch_of, state_of


class GrantingDesk:
    """Takes requests and notes instead of a rig; control is whose who asks for it."""

    def __init__(self, feed):
        self._feed = feed
        self.tokens = Tokens(b"secret")
        self.asked, self.marks, self.answer = [], [], (True, "")

    async def request(self, vehicle, action, arguments, author):
        now_ns = time.monotonic_ns()
        if action in ("take_control", "give_control"):
            holder = author if action == "take_control" else ""
            lease = Lease(now_ns, "", holder, now_ns + 600 * 10**9, "")
            self._feed.take_one(("lease", ""), codec_of(Lease).encode(lease), now_ns)
            return True, ""
        self.asked.append((vehicle, action, dict(arguments), author))
        return self.answer

    def mark(self, text):
        self.marks.append(text)


class ServedConsole:
    """Serves on a port of its own, in a thread, until closed.

    Attributes:
        address: Of it.
        desk: What was asked for.
    """

    def __init__(self, rig: Rig, recording: Path):
        self.feed = Feed(own_tables().payloads)
        self._rig, self._recording = rig, recording
        self._ready = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()), daemon=True)
        self._thread.start()
        assert self._ready.wait(60)

    def close(self):
        self._server.should_exit = True
        self._thread.join(20)

    async def _serve(self):
        self.desk = GrantingDesk(self.feed)
        status = RecorderStatus(1, "", str(self._recording), 5, 10**9, 1e4)
        self.feed.take_one(("recorder_status", ""), codec_of(RecorderStatus).encode(status), 1)
        console = Console(HandSource(self._rig, self.feed), self._rig.tables, Access(port=0), self.desk)
        console.lead(
            Wizards(self._rig, "text", "two.toml", self.feed, self.desk, console.holder, console.hall.tell)
        )
        self._server = uvicorn.Server(
            uvicorn.Config(make_app(console), port=0, log_level="warning", ws="websockets-sansio")
        )
        self._server.install_signal_handlers = lambda: None
        feeding = asyncio.create_task(self._feed_states())
        serving = asyncio.create_task(self._server.serve())
        while not self._server.started:
            await asyncio.sleep(0.02)
        port = self._server.servers[0].sockets[0].getsockname()[1]
        self.address = f"http://127.0.0.1:{port}/"
        self._ready.set()
        await serving
        feeding.cancel()

    async def _feed_states(self):
        while True:
            now_ns = time.monotonic_ns()
            states = [state_of("alpha", now_ns - HOLD_NS), state_of("beta", now_ns - HOLD_NS)]
            self.feed.take_batch(batch_of(states), now_ns)
            await asyncio.sleep(0.05)
