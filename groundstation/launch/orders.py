"""What the launcher tells a process: its orders when it is started, and when to go.

After that stdin stays open for as long as the launcher lives: its end means that nobody watches any more.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Optional

from drivers.laboratory import Address

if TYPE_CHECKING:
    from groundstation.launch.attendant import Attendant


@dataclass(frozen=True)
class Orders:
    """What a process is started with.

    Attributes:
        process: Its name in the plan.
        rig_path: Of the rig file.
        rig_text: What the file reported when the run began.
        files: Every file that the rig names, by absolute path, as it was when the run began: what flew is
            what was hashed.
        endpoint: Of the hub.
        recording: Path of the first recording of the run; used by the recorder.
        restarts: How often the process was started before: a recorder then writes a file of its own.
        utc_offset_ns: UTC minus monotonic clock; used by the recorder.
        sequences_after: Sequence numbers begin after this one.
        attendant: What the process is beside the rig's own; None for those.
    """

    process: str
    rig_path: Path
    rig_text: str
    endpoint: str
    files: dict[str, bytes] = field(default_factory=dict, repr=False)
    recording: Path | None = None
    restarts: int = 0
    utc_offset_ns: int = 0
    sequences_after: int = 0
    attendant: Optional["Attendant"] = None


@dataclass(frozen=True)
class Go:
    """What a process waits for on its stdin, pickled, once it has built its nodes.

    Attributes:
        addresses: Of the laboratory's channels, as announced.
    """

    addresses: dict[str, Address]
