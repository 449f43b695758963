"""The folder of a star-tracker data set: camera.json, ceiling.csv and the pictures in frames/."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.star_camera.picture import decode_picture
from drivers.star_camera.refusals import PictureRefused
from groundstation.files.errors import FileError
from groundstation.files.reading import read_bytes
from groundstation.overhead.overhead_camera import OverheadCamera
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.star_catalogue import StarCatalogue

_ENDINGS = {".png": b"IEND\xaeB`\x82", ".jpg": b"\xff\xd9", ".jpeg": b"\xff\xd9"}
_JPEG_START = b"\xff\xd8"
_SUFFIXES = frozenset({*_ENDINGS, ".bmp", ".pgm", ".tif", ".tiff"})


class DamagedPicture(FileError):  # noqa: N818 - it says what happened
    """A JPEG that its decoder warns of: what it shows may stand elsewhere."""


def find_frames(folder: Path, sub_folder: str = "frames") -> list[Path]:
    """Give the pictures of a data set in the order of their names.

    Raises:
        FileError: There is no such folder, or no picture in it.
    """
    frames = folder / sub_folder
    if not frames.is_dir():
        raise FileError(f"{frames}: no such folder; expected the pictures there.")
    found = sorted(p for p in frames.iterdir() if p.suffix.lower() in _SUFFIXES and p.is_file())
    if not found:
        raise FileError(f"{frames}: holds no picture ({', '.join(sorted(_SUFFIXES))}).")
    return found


def read_frame(
    path: Path, camera: CameraCalibration | OverheadCamera | None, *, is_colour: bool | None = False
) -> NDArray[np.uint8]:
    """Read one 8-bit picture of the camera's size; of any size without a camera.

    Args:
        path: The file.
        camera: Whose size it must have.
        is_colour: Whether it must be in blue-green-red, (h, w, 3), instead of grey, (h, w); None: either.

    Raises:
        DamagedPicture: It is a JPEG that has lost or changed bytes.
        FileError: The file is empty, torn, no picture, in colour or not, not 8 bit, or of another size.
    """
    data = read_bytes(path)
    if not data:
        raise FileError(f"{path}: is an empty file.")
    ending = _ENDINGS.get(path.suffix.lower())
    if ending is not None and ending not in data[-64:]:
        raise FileError(f"{path}: is cut short, its end marker is missing.")
    if data.startswith(_JPEG_START):
        try:
            decode_picture({}, data[: data.rfind(_ENDINGS[".jpg"]) + 2])  # some writers add to the end
        except PictureRefused as refusal:
            raise DamagedPicture(f"{path}: {refusal}.") from refusal
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise FileError(f"{path}: is no picture that can be decoded.")
    if is_colour and (image.ndim != 3 or image.shape[2] != 3):
        raise FileError(f"{path}: is a grey picture or has transparency, expected one in colour.")
    if is_colour is False and image.ndim != 2:
        raise FileError(f"{path}: has {image.shape[2]} colour channels, expected a grey picture.")
    if image.dtype != np.uint8:
        raise FileError(f"{path}: has {8 * image.dtype.itemsize}-bit pixels, expected 8 bit.")
    if camera is not None and image.shape[:2] != (camera.height, camera.width):
        raise FileError(
            f"{path}: is {image.shape[1]} x {image.shape[0]} px, camera.json says "
            f"{camera.width} x {camera.height}."
        )
    return np.asarray(image, dtype=np.uint8)


def load_sky(folder: Path) -> tuple[CameraCalibration, StarCatalogue]:
    """Read camera.json and ceiling.csv of a folder.

    Raises:
        FileError: One of them is missing or wrong.
    """
    if not folder.is_dir():
        raise FileError(f"{folder}: no such folder.")
    camera, ceiling = CameraCalibration.load(folder / "camera.json"), folder / "ceiling.csv"
    catalogue = StarCatalogue.load(ceiling)
    try:
        catalogue.check_in_view(camera, str(ceiling))
    except ValueError as error:
        raise FileError(f"{error}") from error
    return camera, catalogue
