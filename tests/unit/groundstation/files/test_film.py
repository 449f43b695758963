"""A film that the disk did not take is no result, whatever its writer says."""

import cv2
import numpy as np
import pytest

from groundstation.files.errors import FileError
from groundstation.files.film import check_film


@pytest.mark.parametrize("ending", [".avi", ".mp4"])
@pytest.mark.parametrize("count", [1, 12])
def test_a_film_is_whole_or_refused_by_the_name_that_was_asked_for(ending, count, tmp_path):
    part, target = tmp_path / f"part{ending}", tmp_path / f"film{ending}"
    codec = {".avi": "MJPG", ".mp4": "mp4v"}[ending]
    writer = cv2.VideoWriter(str(part), cv2.VideoWriter.fourcc(*codec), 25.0, (320, 240))
    noise = np.random.default_rng(1)
    for _ in range(count):
        writer.write(noise.integers(0, 255, (240, 320, 3), dtype=np.uint8))
    writer.release()
    check_film(part, target, count)
    data = part.read_bytes()
    for kept in (0, 40, *([len(data) // 2] if count > 1 else [])):
        part.write_bytes(data[:kept])
        with pytest.raises(FileError, match=f"^{target}: cannot be written to its end"):
            check_film(part, target, count)
