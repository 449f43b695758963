"""A connection that asks for nothing is closed after ten seconds."""

import asyncio

from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle

PATIENCE_S = 10.0
"""A request has begun by then, headers whole; and its body is read by then."""


class ImpatientProtocol(H11Protocol):
    """HTTP of uvicorn, which by itself waits without end for a request that never comes, or never ends."""

    _watch: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to watch."""
        super().connection_made(transport)
        self._watch = self.loop.call_later(PATIENCE_S, self._look, None)

    def connection_lost(self, exc: Exception | None) -> None:
        """Watch no longer."""
        if self._watch is not None:
            self._watch.cancel()
        super().connection_lost(exc)

    def _look(self, before: RequestResponseCycle | None) -> None:
        if self.transport.is_closing() or self.transport.get_protocol() is not self:
            return  # gone, or a WebSocket, which pings
        cycle = self.cycle
        is_waited_for = cycle is None or cycle.response_complete or cycle.more_body
        if is_waited_for and cycle is before:
            self.transport.close()
            return
        self._watch = self.loop.call_later(PATIENCE_S, self._look, cycle)
