"""Live topics to Foxglove and Lichtblick, by foxglove-sdk: the channels of a recording, while it flies.

Channels, schemas and payloads are those that the recorder writes, so that a layout serves both. Beside them
stand ``/tf`` and ``/table``: where the mock-ups are, and what the table looks like, for a 3D panel.
Log times are UTC; stamps inside messages are of the host's monotonic clock.
"""

import sys
from collections.abc import Mapping
from importlib.util import find_spec
from typing import TYPE_CHECKING

from groundstation.bridges.table_scene import TableScene
from groundstation.bus.cdr import CodecError, codec_of
from groundstation.bus.record_stream import Recorded
from groundstation.bus.ros_schema import ENCODING, schema_text
from groundstation.declarations.errors import UsageError
from groundstation.declarations.message import Message
from groundstation.declarations.names import FOXGLOVE
from groundstation.declarations.rig import Rig
from groundstation.launch.attendant import Attendant
from groundstation.launch.onlooker import look_on
from groundstation.launch.orders import Orders
from groundstation.parts.fusion.messages import VehicleState
from groundstation.recording.channel_names import channel_name
from groundstation.rig.read import parse_rig

if TYPE_CHECKING:
    import foxglove

EXTRA = "foxglove"
PORT, HOST = 8765, "127.0.0.1"


def check_installed() -> None:
    """Refuse where foxglove-sdk is not installed.

    Raises:
        UsageError: It names the extra.
    """
    if find_spec("foxglove") is None:
        raise UsageError(
            f"--foxglove needs foxglove-sdk, which is not installed: pip install 'groundstation[{EXTRA}]'"
        )


class FoxgloveServer:
    """Serves what it is given to whoever connects.

    Args:
        rig: Whose topics they are.
        port: On loopback; 0 for a free one.
        utc_offset_ns: UTC minus monotonic clock.

    Attributes:
        port: It is served on.

    Raises:
        UsageError: The port is taken.
    """

    def __init__(self, rig: Rig, port: int, utc_offset_ns: int) -> None:
        import foxglove  # half a tenth of a second, and an extra

        self._foxglove = foxglove
        self._context = foxglove.Context()
        self._payloads: Mapping[str, type[Message]] = rig.tables.payloads
        self._utc_offset_ns = utc_offset_ns
        self._schemas: dict[str, foxglove.Schema] = {}
        self._channels: dict[tuple[str, str], foxglove.Channel] = {}
        try:
            self._server = foxglove.start_server(name=rig.name, host=HOST, port=port, context=self._context)
        except RuntimeError as error:
            raise UsageError(f"port {port} of {HOST} cannot be served on: {error}") from error
        self.port = self._server.port
        self._scene = TableScene(rig, self._context)

    def take(self, recorded: Recorded) -> None:
        """Hand a message to whoever has subscribed to its channel; one of no known topic is passed over."""
        kind = self._payloads.get(recorded.noun)
        if kind is None:
            return
        key = recorded.noun, recorded.owner
        channel = self._channels.get(key)
        if channel is None:
            channel = self._channels[key] = self._open(kind, recorded.owner)
        log_ns = recorded.publish_ns + self._utc_offset_ns
        channel.log(recorded.data, log_time=log_ns)
        if kind is VehicleState and self._scene.is_wanted:
            try:
                self._scene.move(codec_of(VehicleState).decode(recorded.data), log_ns)
            except CodecError as error:
                sys.stderr.write(f"passed over: {error}\n")

    def _open(self, kind: type[Message], owner: str) -> "foxglove.Channel":
        noun = kind.TOPIC.noun
        schema = self._schemas.get(noun)
        if schema is None:
            text = schema_text(kind).encode()
            schema = self._schemas[noun] = self._foxglove.Schema(
                name=kind.ROS_TYPE, encoding=ENCODING, data=text
            )
        return self._foxglove.Channel(
            channel_name(noun, owner), schema=schema, message_encoding="cdr", context=self._context
        )

    def close(self) -> None:
        """End it; whoever is connected sees the end."""
        self._server.stop()


def attendant(port: int) -> Attendant:
    """The server as the launcher runs it."""
    greeting = (f"{FOXGLOVE}: ws://{HOST}:{port}",)
    return Attendant(FOXGLOVE, f"{__name__}:run", port, greeting)


def run(orders: Orders) -> None:
    """Serve until asked to stop; what the launcher's attendant calls.

    Raises:
        UsageError: The port is taken.
    """
    rig = parse_rig(orders.rig_text, orders.rig_path, orders.files)
    assert orders.attendant is not None
    port = orders.attendant.options
    assert isinstance(port, int)
    server = FoxgloveServer(rig, port, orders.utc_offset_ns)
    latched = {noun for noun, kind in rig.tables.payloads.items() if kind.TOPIC.latched}
    try:
        look_on(orders, server.take, latched)
    finally:
        server.close()
