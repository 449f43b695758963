"""What an emulated laboratory offers a runner.

Two ways to the same laboratory. In lockstep the runner drives it in virtual time through `Laboratory`,
found by name among the installed entry points and never imported by it. Live it is a child process
that prints one `announcement line` on stdout, stating where each of its channels can be opened; from
then on it is hardware like any other.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from importlib.metadata import entry_points
from typing import Protocol, runtime_checkable

from drivers.errors import NotFound
from drivers.quick_record import quickly_made

ENTRY_POINT_GROUP = "groundstation.laboratories"


class ChannelKind(StrEnum):
    """What travels on a channel, which is the type of `Arrival.data`."""

    BYTES = "bytes"
    """`bytes`: a chunk as one read would return it."""
    CAMERA = "camera"
    """`drivers.star_camera.camera_frame.CameraFrame`: one picture."""
    CAN = "can"
    """`drivers.valve_bus.frame.CanFrame`, both ways."""
    FAILURES = "failures"
    """`FailureEvent` and `FailureRefused` from the laboratory, `InjectOrder` into it."""
    POSES = "poses"
    """`drivers.motion_capture.pose.MotionCapturePose`: one rigid body as one frame of the cameras saw it."""


@quickly_made
@dataclass(frozen=True, slots=True, eq=False)
class Arrival:
    """Something that reached the host.

    Attributes:
        stamp_ns: Host monotonic clock (virtual in lockstep) at which the last byte was there.
        channel: `<vehicle>/<device>` or a device all vehicles share: `alpha/imu`, `alpha/star_camera`,
            `alpha/reference`, `valve_bus`. The laboratory's own channel is `laboratory`.
        data: What the channel's kind states.
    """

    stamp_ns: int
    channel: str
    data: object


@runtime_checkable
class Laboratory(Protocol):
    """An emulated laboratory in virtual time. Stamps never go backwards between calls."""

    def channels(self) -> Mapping[str, ChannelKind]:
        """Every channel the laboratory has; does not change while it is open."""
        ...

    def next_arrival_ns(self) -> int | None:
        """Earliest stamp at which something may reach the host if nothing is sent in; None if never.

        May be early (then `advance` returns nothing), never late.
        """
        ...

    def advance(self, stamp_ns: int) -> Sequence[Arrival]:
        """Run up to `stamp_ns` and hand over all that reached the host since, that stamp included.

        Ordered by stamp; arrivals of equal stamp come in an order that the seed alone decides.
        """
        ...

    def deliver(self, stamp_ns: int, channel: str, data: object) -> None:
        """Send something into a channel at `stamp_ns`, which is not before the last `advance`."""
        ...

    def close(self) -> None:
        """Release everything; may be called twice."""
        ...


def load_laboratory(name: str, config: Mapping[str, object], seed: int) -> Laboratory:
    """Make the laboratory that an installed package offers under `name`.

    Args:
        name: The rig's word, an entry point of the group `groundstation.laboratories` that
            resolves to a callable `(config, seed) -> Laboratory`.
        config: The rig's `[laboratory]` table, handed over unread.
        seed: Decides every random number of the laboratory.

    Raises:
        NotFound: No installed package offers that laboratory, or its package cannot be imported.
        TypeError: What the entry point made is no `Laboratory`.
    """
    offered = {point.name: point for point in entry_points(group=ENTRY_POINT_GROUP)}
    if name not in offered:
        known = ", ".join(sorted(offered)) or "none"
        raise NotFound(f"no laboratory named {name!r} is installed (installed: {known})")
    point = offered[name]
    try:
        factory = point.load()
    except (Exception, SystemExit) as error:  # whatever a package of somebody else raises: it is named, once
        raise NotFound(
            f"laboratory {name!r} ({point.value}) cannot be loaded: {type(error).__name__}: {error}"
        ) from error
    laboratory = factory(config, seed)
    if not isinstance(laboratory, Laboratory):
        raise TypeError(f"laboratory {name!r} made a {type(laboratory).__name__}, which is no Laboratory")
    return laboratory
