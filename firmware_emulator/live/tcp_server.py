"""A loopback TCP port for several clients, without threads: all sockets belong to one selector."""

import selectors
import socket
from collections.abc import Callable
from contextlib import suppress

LOOPBACK = "127.0.0.1"
MAX_WAITING_BYTES = 65_536  # a slower client than this loses whole messages, not halves
_READ_BYTES = 4096

Handler = Callable[[], None]
"""What a selector's key carries: called when its file is ready."""


class Client:
    """One connection; writes never block."""

    def __init__(self, connection: socket.socket) -> None:
        self.connection = connection
        self.dropped_messages = 0
        self.waiting = bytearray()

    def send(self, message: bytes) -> None:
        """Send or keep for later; drop the message if too much waits already.

        Raises:
            OSError: The client is gone.
        """
        if len(self.waiting) + len(message) > MAX_WAITING_BYTES:
            self.dropped_messages += 1
            return
        self.waiting += message
        self.flush()

    def flush(self) -> None:
        """Write what the socket takes.

        Raises:
            OSError: The client is gone.
        """
        with suppress(BlockingIOError):
            while self.waiting:
                del self.waiting[: self.connection.send(self.waiting)]


class TcpServer:
    """Listens on a free loopback port and keeps its clients.

    Args:
        selector: Owner of all sockets; its keys carry a `Handler` as data.
        on_bytes: Called with a client and what it sent.
        on_leave: Called when a client has gone.
        on_join: Called with a new client.
    """

    def __init__(
        self,
        selector: selectors.BaseSelector,
        on_bytes: Callable[[Client, bytes], None] | None = None,
        on_leave: Callable[[Client], None] | None = None,
        on_join: Callable[[Client], None] | None = None,
    ) -> None:
        self._selector = selector
        self._on_bytes, self._on_leave, self._on_join = on_bytes, on_leave, on_join
        self._listener = socket.create_server((LOOPBACK, 0))
        self._listener.setblocking(False)
        self.port: int = self._listener.getsockname()[1]
        self.clients: list[Client] = []
        selector.register(self._listener, selectors.EVENT_READ, self._accept)

    @property
    def dropped_messages(self) -> int:
        """Messages that present clients missed because they did not read."""
        return sum(client.dropped_messages for client in self.clients)

    @property
    def url(self) -> str:
        """How pyserial names this port."""
        return f"socket://{LOOPBACK}:{self.port}"

    def broadcast(self, message: bytes, without: Client | None = None) -> None:
        """Send a message to every client but one."""
        for client in list(self.clients):
            if client is not without:
                self.send(client, message)

    def send(self, client: Client, message: bytes) -> None:
        """Send a message to one client; a client that is gone is forgotten."""
        try:
            client.send(message)
        except OSError:
            self._drop(client)
            return
        self._watch(client)

    def close(self) -> None:
        """Close every socket; may be called twice."""
        for client in list(self.clients):
            self._drop(client)
        if self._listener.fileno() >= 0:
            self._selector.unregister(self._listener)
            self._listener.close()

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except OSError:  # gone again before it was let in
            return
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        client = Client(connection)
        self.clients.append(client)
        self._selector.register(connection, selectors.EVENT_READ, lambda: self._serve(client))
        if self._on_join:
            self._on_join(client)

    def _serve(self, client: Client) -> None:
        try:
            client.flush()
            data = client.connection.recv(_READ_BYTES)
        except BlockingIOError:
            self._watch(client)
            return
        except OSError:
            data = b""
        if not data:
            self._drop(client)
            return
        self._watch(client)
        if self._on_bytes:
            self._on_bytes(client, data)

    def _watch(self, client: Client) -> None:
        """Ask for writability only while something waits."""
        wanted = selectors.EVENT_READ | (selectors.EVENT_WRITE if client.waiting else 0)
        key = self._selector.get_key(client.connection)
        if key.events != wanted:
            self._selector.modify(client.connection, wanted, key.data)

    def _drop(self, client: Client) -> None:
        if client in self.clients:
            self.clients.remove(client)
            self._selector.unregister(client.connection)
            client.connection.close()
            if self._on_leave:
                self._on_leave(client)
