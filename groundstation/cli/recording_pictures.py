"""``groundstation recording pictures``: the pictures of a recording with their stars named, as PNG."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer
from numpy.typing import NDArray

from groundstation.declarations.errors import UsageError
from groundstation.files.png import write_png
from groundstation.files.writing import whole_folder
from groundstation.parts.stars.messages import StarMatches, StarPicture
from groundstation.parts.stars.star_answers import notes_of
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recording
from groundstation.star_tracking.picture_drawing import draw_notes
from groundstation.star_tracking.picture_notes import PictureNotes


@dataclass(frozen=True, slots=True, eq=False)
class ExplainedPicture:
    """One picture of a recording and what the star tracker had to say of it.

    Attributes:
        vehicle: Whose camera.
        stamp_ns: Arrival of the picture.
        image: Grey, uint8 (h, w), as the camera gave it.
        notes: Which light is what.
        reason: Why there was no fix; empty for a fix.
    """

    vehicle: str
    stamp_ns: int
    image: NDArray[np.uint8]
    notes: PictureNotes
    reason: str


def explained_pictures(recording: Recording) -> Iterator[ExplainedPicture]:
    """Give the kept pictures of a recording, in the order of their recording.

    Raises:
        RecordingError: The file cannot be read.
    """
    halves: dict[tuple[str, int], StarMatches | StarPicture] = {}
    for message in recording.messages([StarMatches, StarPicture]):
        payload = message.payload
        key = (payload.vehicle, payload.stamp_ns)
        assert isinstance(payload, StarMatches | StarPicture)
        match halves.pop(key, None), payload:
            case (StarMatches() as matches, StarPicture() as picture):
                pass
            case (StarPicture() as picture, StarMatches() as matches):
                pass
            case _:
                halves[key] = payload
                continue
        image = cv2.imdecode(np.frombuffer(picture.data, np.uint8), cv2.IMREAD_GRAYSCALE)
        if image is not None:
            grey = np.asarray(image, dtype=np.uint8)
            yield ExplainedPicture(*key, grey, notes_of(matches), matches.reason)


def pictures(
    file: Annotated[Path, typer.Argument(help="Recording (.mcap).")],
    out: Annotated[Path, typer.Option(help="Folder for the pictures; made if it is not there.")],
    raw: Annotated[bool, typer.Option("--raw", help="Also as the camera gave them, to solve again.")] = False,
) -> None:
    """Write the pictures that gave no fix, and those asked for, with lights ringed and stars named.

    Example: groundstation recording pictures run.mcap --out refused
    """
    count = 0
    try:
        with Recording(file) as recording, whole_folder(out) as folder:
            for found in explained_pictures(recording):
                since_s = (found.stamp_ns - recording.start_ns) * 1e-9
                name = f"{found.vehicle}_{since_s:09.3f}s"
                verdict = found.reason or "fix"
                caption = f"{found.vehicle}, {since_s:.3f} s: {verdict}"
                write_png(folder / f"{name}.png", draw_notes(found.image, found.notes, caption))
                if raw:
                    write_png(folder / f"{name}_raw.png", found.image)
                print(f"{name}.png: {verdict}")
                count += 1
            policy = recording.info.images.value
    except RecordingError as error:
        raise UsageError(str(error)) from error
    if not count:
        why = " (images = 'off' keeps none)" if policy == "off" else ""
        print(f"{file}: holds no picture of a refusal or a request{why}")
