"""Films: OpenCV writes them, and does not say where a disk took no more."""

from pathlib import Path

from groundstation.files.errors import FileError


def check_film(part: Path, target: Path, count: int) -> None:
    """Refuse a film that was not written to its end.

    Args:
        part: As it was written.
        target: What messages call it.
        count: Pictures that it must have.

    Raises:
        FileError: Its last picture is not there.
    """
    import cv2

    film = cv2.VideoCapture(str(part)) if part.exists() and part.stat().st_size else None
    try:
        is_whole = film is not None and film.isOpened() and film.get(cv2.CAP_PROP_FRAME_COUNT) >= count
        if film is not None and is_whole:
            film.set(cv2.CAP_PROP_POS_FRAMES, count - 1)
            is_whole = film.grab()
    finally:
        if film is not None:
            film.release()
    if not is_whole:
        raise FileError(f"{target}: cannot be written to its end (is the disk full?).")
