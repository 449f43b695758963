"""Annotated pictures of the star-tracker commands."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.files.png import write_png
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import detect
from groundstation.star_tracking.fixes import NoFix, PictureFix
from groundstation.star_tracking.picture_drawing import draw_notes
from groundstation.star_tracking.picture_notes import take_notes
from groundstation.star_tracking.star_catalogue import StarCatalogue


@dataclass(frozen=True, slots=True)
class PictureFolder:
    """Where solved pictures are written with their lights ringed and their stars named.

    Attributes:
        folder: There already.
        camera: The camera.
        catalogue: The stars.
        every: Also those that were solved.
    """

    folder: Path
    camera: CameraCalibration
    catalogue: StarCatalogue
    every: bool

    def note(self, name: str, image: NDArray[np.uint8], answer: PictureFix | NoFix) -> None:
        """Write the picture if it is wanted.

        Raises:
            FileError: The file cannot be written.
        """
        if not (self.every or isinstance(answer, NoFix)):
            return
        notes = take_notes(detect(image), answer, self.camera, self.catalogue)
        if isinstance(answer, NoFix):
            caption = f"{name}: {answer.reason.value}: {answer.detail}"
        else:
            caption = (
                f"{name}: {answer.stars} stars, ({1e3 * answer.x_m:.2f}, {1e3 * answer.y_m:.2f}) mm, "
                f"{np.degrees(answer.heading_rad):.3f} deg"
            )
        write_png(self.folder / f"{name}.png", draw_notes(image, notes, caption))
