"""Damaged pictures: how many give a false fix; good ones of every kind: how many are refused as damaged."""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from bench.limits import at_most, plain
from bench.rows import Bench, Row
from bench.star.damages import JPEG, RAW, Image
from bench.star.laboratory import CAMERA_FILE, CEILING_FILE, TAGS, Laboratory, Triple
from drivers.star_camera.picture import decode_picture
from drivers.star_camera.refusals import PictureRefused
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Detector
from groundstation.star_tracking.fixes import NoFix, PictureFix, Refusal
from groundstation.star_tracking.picture_repeats import PictureRepeats
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker

SEED, JPEG_SEED = 9, 23
QUALITIES = (70, 80, 90, 95)
FALSE_M = 2e-3
FALSE_CHI2 = 30.0
"""Squared errors over the stated covariance, of three unknowns: once in 700,000."""
_DAMAGED = 3000
_PERIOD_S = 1.0 / 15.0


class _Product:
    """From the bytes to the fix, as the ground station goes."""

    def __init__(self) -> None:
        camera = CameraCalibration.load(CAMERA_FILE)
        self._tracker = StarTracker(StarCatalogue.load(CEILING_FILE), camera)
        self._find = Detector().find

    def answer(self, image: Image, before: Image | None) -> PictureFix | NoFix | str:
        """A fix, or who refused it; with the picture before where the camera sent one."""
        repeats = PictureRepeats()
        if before is not None:
            repeats.complaint_about(before, 0)
        complaint = repeats.complaint_about(np.ascontiguousarray(image), 1)
        return complaint or self._tracker.solve(self._find(image))


@dataclass(slots=True)
class Damage:
    """What became of damaged pictures; counts by (form, kind).

    Attributes:
        pictures: All of them.
        refused: By the decoder, before anybody looked into them.
        fixes: Right or false.
        false: Wrong by ``FALSE_M``, or beyond what they state.
        decoding_s: CPU times of whole JPEGs.
    """

    pictures: int = 0
    refused: Counter[tuple[str, str]] = field(default_factory=Counter)
    fixes: Counter[tuple[str, str]] = field(default_factory=Counter)
    false: Counter[tuple[str, str]] = field(default_factory=Counter)
    decoding_s: list[float] = field(default_factory=list)

    def row(self, what: str) -> Row:
        """False fixes: none may be."""
        note = ", ".join(f"{count} {form}, {kind}" for (form, kind), count in self.false.items() if count)
        return at_most(
            f"star: false fixes on {self.pictures} damaged {what}", self.false.total(), 0, 0, note=note
        )


def run_damaged(
    kinds: Sequence[tuple[str, str]], count: int, seed: int, say: Callable[[str], None]
) -> Damage:
    """Damage so many pictures, as many of each kind, and look for the stars in them."""
    laboratory, product, rng = Laboratory(seed), _Product(), np.random.default_rng(seed)
    each, found = count // len(kinds), Damage()
    for number, pose in enumerate(laboratory.poses(each)):
        say(f"star: damaged pictures, {number} of {each} of a kind")
        image, before = _two_pictures(laboratory, rng, pose)
        quality = int(rng.choice(QUALITIES))
        for form, kind in kinds:
            found.pictures += 1
            if form == "raw":
                damaged, shown = RAW[kind](rng, image, before), before
            else:
                restarts = 40 if kind == "restart intervals lost" or number % 3 == 0 else 0
                files = [_encode(each_image, quality, restarts) for each_image in (image, before)]
                begin = time.process_time()
                shown = decode_picture({}, files[1])
                found.decoding_s.append(time.process_time() - begin)
                try:
                    damaged = decode_picture({}, JPEG[kind](rng, *files))
                except PictureRefused:
                    found.refused[form, kind] += 1
                    continue
            if damaged.shape != image.shape:
                continue  # the spot finder refuses it
            answer = product.answer(damaged, shown)
            if isinstance(answer, PictureFix):
                found.fixes[form, kind] += 1
                found.false[form, kind] += _is_false(answer, pose)
    return found


def measure(bench: Bench) -> list[Row]:
    """As many damaged pictures as the limit speaks of, whatever ``frames`` is: of all kinds, and JPEGs."""
    jpegs = [("JPEG", kind) for kind in JPEG]
    kinds = jpegs + [("raw", kind) for kind in RAW]
    of_all = run_damaged(kinds, _DAMAGED, SEED, bench.say)
    of_jpegs = run_damaged(jpegs, _DAMAGED, JPEG_SEED, bench.say)
    rows = [of_all.row("pictures of twelve kinds"), of_jpegs.row("JPEGs")]
    rows += [
        plain(
            f"star: {form}, {kind}: fixes, all right but those",
            [of_all.fixes[form, kind], of_all.false[form, kind]],
        )
        for form, kind in kinds
    ]
    rows.append(
        plain(
            "star: damaged JPEGs that the decoder refuses", 100.0 * of_jpegs.refused.total() / _DAMAGED, "%"
        )
    )
    rows.append(_good_ones(bench, Laboratory(SEED), _Product()))
    decoding_ms = 1e3 * float(np.median(of_jpegs.decoding_s))
    rows.append(plain("star: decoding a JPEG, its check included, median", decoding_ms, "ms"))
    return rows


def _two_pictures(laboratory: Laboratory, rng: np.random.Generator, pose: Triple) -> tuple[Image, Image]:
    """A picture of a body that moves, and the one before it."""
    velocity = rng.uniform(-0.3, 0.3, 3) * (1.0, 1.0, 1.5)
    before = np.asarray(pose) - _PERIOD_S * velocity
    return laboratory.picture(pose, velocity, 0.003), laboratory.picture(before, velocity, 0.003)


def _encode(image: Image, quality: int, restarts: int) -> bytes:
    options = [cv2.IMWRITE_JPEG_QUALITY, quality, cv2.IMWRITE_JPEG_RST_INTERVAL, restarts]
    return cv2.imencode(".jpg", image, options)[1].tobytes()


def _is_false(fix: PictureFix, pose: Triple) -> bool:
    error = np.subtract((fix.x_m, fix.y_m, fix.heading_rad), pose)
    error[2] = np.angle(np.exp(1j * error[2]))
    chi2 = float(error @ np.linalg.solve(fix.covariance, error))
    return bool(np.hypot(error[0], error[1]) > FALSE_M or chi2 > FALSE_CHI2)


def _good_ones(bench: Bench, laboratory: Laboratory, product: _Product) -> Row:
    refused: Counter[str] = Counter()
    seen = 0
    for tag in TAGS:
        if tag == "dark":
            continue
        bench.say(f"star: good pictures, {tag}")
        for number, frame in enumerate(laboratory.frames(tag, bench.frames)):
            file = _encode(frame.image, QUALITIES[number % len(QUALITIES)], 0)
            answer = product.answer(decode_picture({}, file) if number % 2 else frame.image, None)
            seen += 1
            is_torn = isinstance(answer, NoFix) and answer.reason is Refusal.TORN
            refused[tag] += is_torn or isinstance(answer, str)
    note = ", ".join(f"{count} {tag}" for tag, count in refused.items() if count)
    return at_most(
        f"star: good pictures refused as damaged, of {seen}", 100.0 * refused.total() / seen, 1, 0, "%", note
    )
