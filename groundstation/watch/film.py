"""A run as a film: the table drawn from above, or the pictures of the camera over it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.declarations.errors import UsageError
from groundstation.files.film import check_film_name, new_film
from groundstation.parts.overhead.messages import OverheadImage
from groundstation.parts.table import installed_tables
from groundstation.recording.reader import Recording
from groundstation.watch.flown_run import read_run
from groundstation.watch.table_picture import TablePicture

Progress = Callable[[str, float], None]
Picture = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class FilmPlan:
    """What is to be filmed.

    Attributes:
        from_s: From here, s since the recording began.
        to_s: To here; None for the end.
        speed: Seconds of flight in a second of film.
        frames_per_s: Of the film.
        height_px: Of a drawn picture, about.
        is_of_camera: The camera's pictures instead of a drawing.
    """

    from_s: float = 0.0
    to_s: float | None = None
    speed: float = 1.0
    frames_per_s: float = 25.0
    height_px: int = 720
    is_of_camera: bool = False


def write_film(recording: Path, target: Path, plan: FilmPlan, progress: Progress) -> tuple[int, str]:
    """Film a recording.

    Args:
        recording: An ``.mcap`` file, or the folder of a run.
        target: The film; it appears only once it is complete.
        plan: What is filmed.
        progress: Takes what is being done, and the share that is done.

    Returns:
        How many pictures it has, and its codec.

    Raises:
        UsageError: There is nothing to film.
        RecordingError: The recording cannot be read.
        FileError: The film cannot be written, or there is no codec for such a file.
    """
    check_film_name(target)
    progress("reading the recording", 0.0)
    if plan.is_of_camera:
        times_s, size, picture_at = _of_camera(recording, plan)
    else:
        times_s, size, picture_at = _drawn(recording, plan)
    if not len(times_s):
        end = "its end" if plan.to_s is None else f"{plan.to_s:g} s"
        raise UsageError(f"{recording}: nothing lies between {plan.from_s:g} s and {end}")
    with new_film(target, plan.frames_per_s, size) as film:
        for done, t_s in enumerate(times_s.tolist()):
            film.write(picture_at(t_s))
            progress("filming", done / len(times_s))
    return film.count, film.codec


Shown = tuple[NDArray[np.float64], tuple[int, int], Callable[[float], Picture]]
"""Moments of the pictures, their width and height, and what makes the picture of a moment."""


def _moments(plan: FilmPlan, duration_s: float) -> NDArray[np.float64]:
    end_s = duration_s if plan.to_s is None else min(plan.to_s, duration_s)
    return np.arange(plan.from_s, end_s, plan.speed / plan.frames_per_s)


def _drawn(recording: Path, plan: FilmPlan) -> Shown:
    run = read_run(recording, installed_tables())
    drawing = TablePicture(run, plan.height_px)
    return _moments(plan, run.duration_s), drawing.size_px, drawing.at


def _of_camera(path: Path, plan: FilmPlan) -> Shown:
    with Recording(path) as recording:
        start_ns, duration_s = recording.start_ns, (recording.stop_ns - recording.start_ns) * 1e-9
        if not recording.has(OverheadImage, ""):
            raise UsageError(
                f"{path} holds no pictures of the camera over the table: they are kept where the rig says "
                'record.images = "lossless"'
            )
    moments = _moments(plan, duration_s)
    pictures = _camera_pictures(path, start_ns)
    newest: list[tuple[float, Picture]] = [next(pictures)]
    following: list[tuple[float, Picture] | None] = [next(pictures, None)]
    height, width = newest[0][1].shape[:2]
    size = (width // 2 * 2, height // 2 * 2)

    def picture_at(t_s: float) -> Picture:
        while (after := following[0]) is not None and after[0] <= t_s:
            newest[0], following[0] = after, next(pictures, None)
        shown = newest[0][1][: size[1], : size[0]].copy()
        cv2.putText(
            shown, f"{t_s:.1f} s", (10, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.6, (0, 255, 255), 1, cv2.LINE_AA
        )
        return shown

    return moments, size, picture_at


def _camera_pictures(path: Path, start_ns: int) -> Iterator[tuple[float, Picture]]:
    """Moments and pictures of the camera, in colour."""
    with Recording(path) as recording:
        for message in recording.messages([OverheadImage]):
            image = message.payload
            assert isinstance(image, OverheadImage)
            rows = np.frombuffer(image.data, np.uint8).reshape(image.height, image.step)
            if image.encoding == "mono8":
                picture = cv2.cvtColor(rows[:, : image.width], cv2.COLOR_GRAY2BGR)
            else:
                picture = rows[:, : 3 * image.width].reshape(image.height, image.width, 3)
            yield (image.stamp_ns - start_ns) * 1e-9, np.asarray(picture, np.uint8)
