"""`groundstation relative track`: a pose for every frame."""

from __future__ import annotations

import gc
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer

from groundstation.cli.progress import with_progress
from groundstation.cli.relative_film import track_film
from groundstation.cli.relative_review import Review
from groundstation.data_sets.relative_case import RelativeCase, load_case
from groundstation.data_sets.relative_film import Film
from groundstation.data_sets.relative_looks import looks_of
from groundstation.data_sets.relative_pixels import read_pixels
from groundstation.declarations.errors import UsageError
from groundstation.files.film import check_film_name
from groundstation.files.writing import Content, check_targets, write_files
from groundstation.relative_navigation.answers import Status, Track
from groundstation.relative_navigation.motion_models import DEFAULT as DEFAULT_MOTION
from groundstation.relative_navigation.motion_models import MOTION_MODELS, Tracker
from groundstation.relative_navigation.solvers import DEFAULT as DEFAULT_SOLVER
from groundstation.relative_navigation.solvers import SOLVERS
from groundstation.relative_navigation.tracker_settings import Frame

HEADER = "frame,t,status,x,y,z,q0,q1,q2,q3,wx,wy,wz,std_pos_m,std_att_deg,ms\n"
RATES_HEADER = "frame,t,vx_m_s,vy_m_s,vz_m_s,wx_rad_s,wy_rad_s,wz_rad_s\n"
LEAST_RATE_HZ, MOST_RATE_HZ = 1e-3, 10_000.0
"""Of a film: slower, and nothing of the motion between two frames is foretold."""
Answer = tuple[Track, float]
"""A frame's answer, and the CPU time that it took, ms."""


def track(
    case: Annotated[
        Path | None, typer.Argument(help="CASE.json, or a TOML target file with the same keys.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="CSV to write, a row per frame.")] = None,
    pixels: Annotated[Path | None, typer.Option(help="CSV of centres: frame,t,marker,u,v.")] = None,
    video: Annotated[
        Path | None, typer.Option(help="Film to look at instead: a video, FRAMES.npz, a folder of pictures.")
    ] = None,
    target: Annotated[
        Path | None,
        typer.Option(help="TOML target file, the same as the argument; `relative target` makes one."),
    ] = None,
    motion_model: Annotated[
        str, typer.Option(help=f"Between frames, one of: {', '.join(MOTION_MODELS)}.")
    ] = DEFAULT_MOTION,
    solver: Annotated[
        str, typer.Option(help=f"Of each frame, one of: {', '.join(SOLVERS)}.")
    ] = DEFAULT_SOLVER,
    rate_hz: Annotated[
        float | None, typer.Option(help="Frames a second of the film, where its file does not tell.")
    ] = None,
    annotated: Annotated[
        Path | None, typer.Option(help="Film to write with what was found drawn in (.avi or .mp4).")
    ] = None,
    review: Annotated[
        Path | None,
        typer.Option(help="HTML page to write: frames with residuals, courses of pose and sigma."),
    ] = None,
    rates: Annotated[
        Path | None, typer.Option(help="CSV to write as well: linear and angular rates of every frame.")
    ] = None,
) -> None:
    """Find the target in every frame: pose, rates, sigmas.

    X_camera = C(q) X_body + t; x right, y down, z forward; rates are absolute, in body axes.

    Example: groundstation relative track case.json --pixels pixels.csv --out poses.csv

    Example: groundstation relative track target.toml --video film.avi --out poses.csv --review review.html
    """
    for name, value, table in (("motion-model", motion_model, MOTION_MODELS), ("solver", solver, SOLVERS)):
        if value not in table:
            raise UsageError(f"--{name} must be one of {', '.join(table)}, found {value!r}.")
    if (case is None) == (target is None):
        raise UsageError("give one case: CASE.json as an argument, or --target TARGET.toml.")
    if (pixels is None) == (video is None):
        raise UsageError("give either --pixels PIXELS.csv or --video FILE.")
    if out is None:
        raise UsageError("give --out POSES.csv, the table to write.")
    if video is None and (annotated or review or rate_hz is not None):
        raise UsageError("--annotated, --review and --rate-hz go with --video.")
    if rate_hz is not None and not LEAST_RATE_HZ <= rate_hz <= MOST_RATE_HZ:
        raise UsageError(f"--rate-hz must be {LEAST_RATE_HZ:g} to {MOST_RATE_HZ:g}, found {rate_hz:g}.")
    if annotated is not None:
        check_film_name(annotated, "the film of --annotated")
    check_targets(out, annotated, review, rates, sources=[case, target, pixels, video])
    path = case if case is not None else target
    assert path is not None
    found = load_case(path)
    contents: dict[Path, Content] = {}
    notes: list[str] = []
    if pixels is not None:
        answers = list(answers_of(read_pixels(pixels, found), lambda: _tracker(found, motion_model, solver)))
    else:
        assert video is not None
        film = Film(video, found.settings.camera, rate_hz)
        page = None if review is None else Review(f"{video.name}: {path.name}", film.count)
        done = track_film(
            film,
            found.settings,
            looks_of(found, path),
            _tracker(found, motion_model, solver),
            annotated,
            page,
        )
        answers, notes = done.answers, done.notes
        if review is not None and page is not None:
            words = "\n".join((summary(answers), *notes))
            contents[review] = page.page([answer for answer, _ in answers], words)
    contents[out] = poses_csv(answers)
    if rates is not None:
        contents[rates] = rates_csv(answers)
    write_files(contents)
    print(summary(answers))
    for note in notes:
        print(f"  {note}")


def _tracker(case: RelativeCase, motion_model: str, solver: str) -> Tracker:
    return MOTION_MODELS[motion_model](case.settings, SOLVERS[solver]())


def answers_of(frames: list[Frame], make: Callable[[], Tracker]) -> Iterator[Answer]:
    """Give every frame to a tracker."""
    cv2.setNumThreads(1)
    warm = make()
    for frame in frames[:3]:
        warm.look(frame)  # the first calls pay for lazy imports and memory
    tracker = make()
    with ExitStack() as stack:
        gc.freeze()  # else the collector now and then looks at every loaded module: 20 ms in a frame's time
        stack.callback(gc.unfreeze)
        for frame in with_progress(frames, "tracking"):
            begin = time.process_time()
            answer = tracker.look(frame)
            yield answer, 1000.0 * (time.process_time() - begin)


def poses_csv(answers: list[Answer]) -> Iterator[str]:
    """The table of poses; what is unknown is nan."""
    yield HEADER
    for answer, ms in answers:
        if answer.pose is None:
            place, q = np.full(3, np.nan), np.full(4, np.nan)
        else:
            place, q = answer.pose.position_camera_m, answer.pose.quaternion
        numbers = (
            *(f"{x:.9g}" for x in place),
            *(f"{x:.10f}" for x in q),
            *(f"{x:.9g}" for x in answer.rate_rad_s),
            f"{answer.sigma_position_m:.4e}",
            f"{np.degrees(answer.sigma_attitude_rad):.4e}",
            f"{ms:.3f}",
        )
        yield f"{answer.frame},{answer.t_s:.9g},{answer.status.value},{','.join(numbers)}\n"


def rates_csv(answers: list[Answer]) -> Iterator[str]:
    """The table of rates: of the centre of mass in the orbital frame, and of the turn in body axes."""
    yield RATES_HEADER
    for answer, _ in answers:
        numbers = ",".join(f"{x:.9g}" for x in (*answer.velocity_m_s, *answer.rate_rad_s))
        yield f"{answer.frame},{answer.t_s:.9g},{numbers}\n"


def summary(answers: list[Answer]) -> str:
    """What became of the frames, in words."""
    counts = Counter(answer.status for answer, _ in answers)
    words = ", ".join(f"{counts[status]} {status.value}" for status in Status if counts[status])
    reasons = Counter(answer.reason.value for answer, _ in answers if answer.reason.value)
    lines = [f"{len(answers)} frames: {words}."]
    lines += [f"  {reason}: {count}" for reason, count in sorted(reasons.items())]
    return "\n".join(lines)
