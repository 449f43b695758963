"""A film through a tracker: answers, the annotated film, the page of the review."""

from __future__ import annotations

import time
from collections import Counter
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.cli.progress import progress_line
from groundstation.cli.relative_review import Review
from groundstation.data_sets.relative_film import Film, Shot
from groundstation.files.film import new_film
from groundstation.relative_navigation.answers import Track
from groundstation.relative_navigation.motion_models import Tracker
from groundstation.relative_navigation.overlay import draw_track
from groundstation.relative_navigation.spots import SpotFinder, SpotSettings, SpotsSeen, Trouble, nothing
from groundstation.relative_navigation.tracker_settings import Frame, TrackerSettings

Picture = NDArray[np.uint8]

_PREVIEW_HZ = 30.0
"""Of the annotated film, where the frames come more slowly than a film can be."""


@dataclass(frozen=True, slots=True, eq=False)
class FilmAnswers:
    """What became of a film.

    Attributes:
        answers: Each frame's answer and its CPU time, ms.
        notes: For people: what was wrong with the pictures.
    """

    answers: list[tuple[Track, float]]
    notes: list[str]


def track_film(
    film: Film,
    settings: TrackerSettings,
    looks: SpotSettings,
    tracker: Tracker,
    annotated: Path | None,
    review: Review | None,
) -> FilmAnswers:
    """Give every frame to a tracker, and draw what is wanted."""
    cv2.setNumThreads(1)
    finder = SpotFinder(looks)
    finder.look(np.zeros((settings.camera.height_px, settings.camera.width_px), np.uint8))
    size = (settings.camera.width_px, settings.camera.height_px)
    rate_hz = film.rate_hz if film.rate_hz > 0.5 else _PREVIEW_HZ
    answers: list[tuple[Track, float]] = []
    troubles: Counter[Trouble] = Counter()
    with ExitStack() as stack:
        progress = stack.enter_context(progress_line())
        seen_film = None if annotated is None else stack.enter_context(new_film(annotated, rate_hz, size))
        for shot in film.shots():
            begin = time.process_time()
            seen = _seen(shot, finder)
            track = tracker.look(Frame(shot.number, shot.t_s, seen.centres))
            answers.append((track, 1000.0 * (time.process_time() - begin)))
            troubles[seen.trouble] += 1
            if seen_film is not None or (review is not None and review.wants(track)):
                picture = shot.picture if shot.picture is not None else _black(settings)
                drawn = draw_track(picture, settings.camera, settings.target, track, seen.centres)
                if seen_film is not None:
                    seen_film.write(drawn)
                if review is not None and review.wants(track):
                    review.add(track, drawn)
            progress("tracking", shot.number / film.count if film.count else float("nan"))
    notes = [
        f"{trouble.value}: {troubles[trouble]}" for trouble in Trouble if trouble.value and troubles[trouble]
    ]
    if film.broken_from is not None:
        notes.append(
            f"the film is broken from frame {film.broken_from} on: {film.unreadable} of {film.count} frames "
            "cannot be read"
        )
    if film.complaints:
        notes.append(f"the decoder of the film complained at {film.complaints} frames: they may be damaged")
    return FilmAnswers(answers, notes)


def _seen(shot: Shot, finder: SpotFinder) -> SpotsSeen:
    return nothing(shot.trouble) if shot.picture is None else finder.look(shot.picture)


def _black(settings: TrackerSettings) -> Picture:
    return np.zeros((settings.camera.height_px, settings.camera.width_px), np.uint8)
