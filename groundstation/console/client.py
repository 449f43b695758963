"""One screen that looks: what it still has to be sent, and how much of it is kept while it does not read."""

import asyncio
from collections import deque
from typing import Protocol

MOST_QUEUED_BYTES = 2_000_000
"""Of lists and charts that a screen has not read; what is newest only takes no more than one frame each."""


class Socket(Protocol):
    """A WebSocket."""

    async def send_bytes(self, data: bytes) -> None:
        """Send a frame; waits while the other side does not read."""


class Client:
    """Frames on their way to one screen.

    A screen that does not read delays nobody: of what is drawn only the newest frame waits, and the rest is
    dropped, whole, when it grows too long; the screen is told.

    Args:
        socket: To the screen.
    """

    def __init__(self, socket: Socket) -> None:
        self._socket = socket
        self._newest: dict[str, bytes] = {}
        self._queue: deque[bytes] = deque()
        self._queued_bytes = 0
        self._something = asyncio.Event()
        self.dropped = 0

    @property
    def waiting_bytes(self) -> int:
        """Of all frames that wait."""
        return self._queued_bytes + sum(map(len, self._newest.values()))

    def show(self, what: str, frame: bytes) -> None:
        """Send a frame that replaces the one of the same name, if that has not been sent yet."""
        self._newest[what] = frame
        self._something.set()

    def append(self, frame: bytes) -> None:
        """Send a frame after those before it; all are dropped when too many wait."""
        if self._queued_bytes + len(frame) > MOST_QUEUED_BYTES:
            self.dropped += len(self._queue)
            self._queue.clear()
            self._queued_bytes = 0
        self._queue.append(frame)
        self._queued_bytes += len(frame)
        self._something.set()

    async def send(self) -> None:
        """Send what there is to send, until cancelled or the screen is gone."""
        while True:
            await self._something.wait()
            self._something.clear()
            while self._newest or self._queue:
                for what in list(self._newest):
                    await self._socket.send_bytes(self._newest.pop(what))
                if self._queue:
                    frame = self._queue.popleft()
                    self._queued_bytes -= len(frame)
                    await self._socket.send_bytes(frame)
