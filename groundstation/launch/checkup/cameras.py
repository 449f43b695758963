"""Cameras: whether they are there, may be used, and what they really give: size, rate, format."""

import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

from drivers.errors import DeviceError
from drivers.laboratory import CameraFrame
from groundstation.declarations.port import Port
from groundstation.launch.checkup.finding import Finding, Machine, bad, ok, permission, warn

LOOKS_S = 2.0
LEAST_RATE_HZ = 5.0
_LOSSY = ("MJPG", "JPEG", "H264", "HEVC")


class Measured(NamedTuple):
    """What came from a camera while somebody looked.

    Attributes:
        width: Of the pictures, px.
        height: Of the pictures, px.
        rate_hz: Pictures per second.
    """

    width: int
    height: int
    rate_hz: float


def device_of(address: str) -> str | None:
    """Path of a video device; None for a stream or a folder."""
    if address.isdecimal():
        return f"/dev/video{address}"
    return address if address.startswith("/dev/") else None


def plugged_in(machine: Machine) -> Iterator[Finding]:
    """Every video device, unopened: somebody may be using it."""
    for path in sorted(machine.at("dev").glob("video*")):
        shown = f"/dev/{path.name}"
        name = machine.text(f"sys/class/video4linux/{path.name}/name") or "no name"
        yield permission(machine, "camera", path, shown) or ok("camera", f"{shown} ({name}) may be used")


def measure(port: Port, looks_s: float = LOOKS_S) -> Measured | None:
    """Look at what a camera gives; None if nothing came.

    Raises:
        DeviceError: It cannot be opened, or is lost.
    """
    edge = port.open()
    stamps_ns: list[int] = []
    shape: tuple[int, ...] = ()
    until_s = time.monotonic() + looks_s
    try:
        while time.monotonic() < until_s:
            for stamp_ns, data in edge.read():
                assert isinstance(data, CameraFrame)
                stamps_ns.append(stamp_ns)
                shape = data.image.shape
    finally:
        edge.close()
    if len(stamps_ns) < 2:
        return None
    return Measured(shape[1], shape[0], (len(stamps_ns) - 1) * 1e9 / (stamps_ns[-1] - stamps_ns[0]))


def camera(
    machine: Machine,
    port: Port,
    wanted_px: tuple[int, int] | None,
    look: Callable[[Port], Measured | None] = measure,
) -> Iterator[Finding]:
    """A camera of a rig.

    Args:
        machine: Whose it is.
        port: As the rig names it.
        wanted_px: Width and height that its calibration is of; None where there is none.
        look: Tells what it gives.
    """
    subject, address = port.channel, str(port.address)
    device = device_of(address)
    if device is not None:
        trouble = permission(machine, subject, machine.at(device), device)
        if trouble is not None:
            yield trouble
            return
    try:
        found = look(port)
    except DeviceError as error:
        yield bad(
            subject, str(error), "end other programs that use it; try it with `v4l2-ctl --list-formats`"
        )
        return
    if found is None:
        yield bad(subject, f"{address} gave no pictures for {LOOKS_S:g} s", "unplug it and plug it in again")
        return
    words = f"{found.width} x {found.height} px, {found.rate_hz:.1f} pictures a second"
    if wanted_px is not None and (found.width, found.height) != wanted_px:
        yield bad(
            subject,
            f"{words}; its calibration is of {wanted_px[0]} x {wanted_px[1]} px",
            "set the size that it was calibrated with, or calibrate it again",
        )
    elif found.rate_hz < LEAST_RATE_HZ:
        yield warn(subject, f"{words}: few", "a long exposure, or USB that is shared with another camera")
    else:
        yield ok(subject, words)
    if device is not None:
        yield from _format(subject, device)


def _format(subject: str, device: str) -> Iterator[Finding]:
    """The format that a video device sends, as OpenCV reports it."""
    import cv2  # a quarter of a second that a look at other things has not

    capture = cv2.VideoCapture(device, cv2.CAP_V4L2)
    code = int(capture.get(cv2.CAP_PROP_FOURCC)) if capture.isOpened() else 0
    capture.release()
    name = code.to_bytes(4, "little").decode("ascii", "replace").strip("\0 ") if code > 0 else ""
    if name in _LOSSY:
        yield warn(
            subject,
            f"it sends {name}: blocks of the compression move centroids",
            f"v4l2-ctl -d {device} --set-fmt-video=pixelformat=GREY, or YUYV, where the camera has it",
        )
    elif name:
        yield ok(subject, f"it sends {name}")
