"""Turn rates and star headings for the delay's calibration, from a recording."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.bus.topics import topic_of
from groundstation.cli.errors import UsageError
from groundstation.messages.definitions import Imu, StarFix
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recording
from groundstation.runtime.rig import parse_rig

Array = NDArray[np.float64]

_RATE_USABLE = 1


@dataclass(frozen=True, slots=True, eq=False)
class Turns:
    """What ``delay_from_headings`` takes, times from the first sample on.

    Attributes:
        gyro_t_s: End of each sample's window.
        rate_rad_s: Turn rates.
        arrival_t_s: When each heading's picture arrived.
        heading_rad: Headings by the stars.
        guess_s: The delay that the rig had.
    """

    gyro_t_s: Array
    rate_rad_s: Array
    arrival_t_s: Array
    heading_rad: Array
    guess_s: float


def turns_of(path: Path, vehicle: str | None) -> Turns:
    """Read them from a recording of a rig with a star camera.

    The fixes are stamped with arrival minus the rig's delay; it is added again.

    Args:
        path: Recording.
        vehicle: Whose; None if it holds only one with a star camera.

    Raises:
        UsageError: The recording cannot be read, or has no such vehicle, or no samples or fixes of it.
    """
    try:
        with Recording(path) as recording:
            rig = parse_rig(recording.info.rig_toml, Path(recording.info.rig_path))
            known = [name for name, section in rig.vehicles.items() if section.star_camera is not None]
            if vehicle is None and len(known) == 1:
                vehicle = known[0]
            if vehicle not in known:
                asked = "name one with --vehicle" if vehicle is None else f"{vehicle!r} is none of them"
                raise UsageError(f"{path}: star cameras fly on {', '.join(known) or 'no vehicle'}: {asked}.")
            samples, fixes = [], []
            for message in recording.messages({topic_of(Imu), topic_of(StarFix)}, {vehicle}):
                payload = message.payload
                if isinstance(payload, Imu) and payload.usable & _RATE_USABLE:
                    samples.append((payload.stamp_ns, payload.rate_body_rad_s))
                elif isinstance(payload, StarFix) and payload.fix:
                    fixes.append((payload.stamp_ns, payload.heading_rad))
    except RecordingError as error:
        raise UsageError(str(error)) from error
    if not samples or not fixes:
        raise UsageError(
            f"{path}: holds {len(samples)} IMU samples and {len(fixes)} star fixes of {vehicle}."
        )
    camera = rig.mock_up_of(vehicle).star_camera
    delay_s = 0.0 if camera is None else camera.delay_s
    start_ns = samples[0][0]

    def seconds(rows: list[tuple[int, float]]) -> Array:
        return np.array([(stamp_ns - start_ns) * 1e-9 for stamp_ns, _ in rows])

    return Turns(
        seconds(samples),
        np.array([rate for _, rate in samples]),
        seconds(fixes) + delay_s,
        np.array([heading for _, heading in fixes]),
        delay_s,
    )
