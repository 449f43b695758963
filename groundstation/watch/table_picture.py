"""The table from above as a picture at one moment: mock-ups to scale, trails, goals, firing thrusters."""

import math
from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.control.vehicle import square_of_eight
from groundstation.watch.flown_run import FlownRun
from groundstation.watch.page.plan import trail
from groundstation.watch.run_events import Mark
from groundstation.watch.tracks import Array, Track

Picture = NDArray[np.uint8]
Colour = tuple[int, int, int]
_PAPER, _TABLE, _GRID, _EDGE, _INK, _FAINT = (
    (246, 244, 243), (255, 255, 255), (234, 231, 228), (169, 161, 154), (36, 32, 28), (122, 112, 104),
)  # fmt: skip
_VEHICLES: tuple[Colour, ...] = (
    (187, 111, 42), (61, 85, 200), (85, 138, 47), (184, 86, 127), (12, 121, 165), (91, 85, 80),
)  # fmt: skip
_FLAME, _OBSTACLE, _WARN = (30, 150, 255), (190, 190, 190), (45, 40, 192)
_AROUND_M = 0.15
_TRAIL_S = 30.0
_FLAME_M = 0.14
_STRIP_PX = 54
_SHOWN_S = 4.0
"""So long what has happened is named below."""
_SHIFT = 4
_ONE = 1 << _SHIFT


class TablePicture:
    """Draws one run. Pictures are all of one size, even in both directions, as codecs want them.

    Args:
        run: What was flown.
        height_px: Of a picture, about.
    """

    def __init__(self, run: FlownRun, height_px: int) -> None:
        self._run = run
        self._trails = {name: trail(track) for name, track in run.tracks.items()}
        x_low, x_high, y_low, y_high = run.rig.table_m or self._reached()
        self._low = np.array([x_low - _AROUND_M, y_low - _AROUND_M])
        self._high = np.array([x_high + _AROUND_M, y_high + _AROUND_M])
        self._edges = (x_low, x_high, y_low, y_high)
        self._scale = (height_px - _STRIP_PX) / float(self._high[1] - self._low[1])
        width, height = ((self._high - self._low) * self._scale).tolist()
        self.size_px = (2 * round(width / 2), 2 * round((height + _STRIP_PX) / 2))
        """Width and height."""
        self._colours = {name: _VEHICLES[k % len(_VEHICLES)] for k, name in enumerate(run.vehicles)}
        self._ground = self._drawn_ground()

    def at(self, t_s: float) -> Picture:
        """The picture of a moment (s since the recording began), uint8 (height, width, 3), as OpenCV."""
        canvas = self._ground.copy()
        for name, rows in self._trails.items():
            self._draw_trail(canvas, rows, t_s, self._colours[name])
        for name, track in self._run.tracks.items():
            self._draw_goal(canvas, track, t_s, self._colours[name])
        for name, track in self._run.tracks.items():
            pose = pose_at(self._trails[name], t_s)
            if pose is not None:
                self._draw_mock_up(canvas, name, track, pose, t_s)
        self._draw_words(canvas, t_s)
        return canvas

    def _reached(self) -> tuple[float, float, float, float]:
        rows = np.concatenate(list(self._trails.values()))
        x, y = rows[:, 1], rows[:, 2]
        return float(x.min()) - 0.3, float(x.max()) + 0.3, float(y.min()) - 0.3, float(y.max()) + 0.3

    def _pixels(self, xy_m: Array) -> NDArray[np.int32]:
        """Places (n, 2) on the table as OpenCV's points with fractions, y up."""
        across = (xy_m[:, 0] - self._low[0]) * self._scale
        down = (self._high[1] - xy_m[:, 1]) * self._scale
        found: NDArray[np.int32] = np.rint(np.column_stack([across, down]) * _ONE).astype(np.int32)
        return found

    def _lines(
        self, canvas: Picture, xy_m: Array, colour: Colour, thick: int = 1, *, closed: bool = False
    ) -> None:
        cv2.polylines(canvas, [self._pixels(xy_m)], closed, colour, thick, cv2.LINE_AA, _SHIFT)

    def _drawn_ground(self) -> Picture:
        width, height = self.size_px
        canvas = np.full((height, width, 3), _PAPER, np.uint8)
        x_low, x_high, y_low, y_high = self._edges
        corners = np.array([[x_low, y_low], [x_high, y_low], [x_high, y_high], [x_low, y_high]])
        cv2.fillPoly(canvas, [self._pixels(corners)], _TABLE, cv2.LINE_AA, _SHIFT)
        for x in np.arange(math.ceil(x_low * 2) / 2, x_high, 0.5).tolist():
            self._lines(canvas, np.array([[x, y_low], [x, y_high]]), _GRID)
        for y in np.arange(math.ceil(y_low * 2) / 2, y_high, 0.5).tolist():
            self._lines(canvas, np.array([[x_low, y], [x_high, y]]), _GRID)
        self._lines(canvas, corners, _EDGE, 2, closed=True)
        for x_m, y_m, radius_m in self._run.rig.keep_out:
            centre = tuple(self._pixels(np.array([[x_m, y_m]]))[0].tolist())
            cv2.circle(
                canvas, centre, round(radius_m * self._scale * _ONE), _OBSTACLE, -1, cv2.LINE_AA, _SHIFT
            )
        return canvas

    def _draw_trail(self, canvas: Picture, rows: Array, t_s: float, colour: Colour) -> None:
        begin, end = np.searchsorted(rows[:, 0], (t_s - _TRAIL_S, t_s), "right").tolist()
        if end - begin < 2:
            return
        places = self._pixels(rows[begin:end, 1:3])
        moved = np.any(np.diff(places >> _SHIFT, axis=0), axis=1)
        kept = places[np.flatnonzero(np.concatenate([[True], moved]))]
        pieces = np.array_split(kept, 6)
        for older, (piece, following) in enumerate(
            zip(pieces, [*pieces[1:], kept[-1:]], strict=True), start=1
        ):
            line = np.concatenate([piece, following[:1]])
            if len(line) > 1:
                cv2.polylines(canvas, [line], False, _paler(colour, older / 6), 2, cv2.LINE_AA, _SHIFT)

    def _draw_goal(self, canvas: Picture, track: Track, t_s: float, colour: Colour) -> None:
        place = int(np.searchsorted(track.goal[:, 0], t_s, "right")) - 1
        if place >= 0:
            u, v = (self._pixels(track.goal[place : place + 1, 1:3])[0] >> _SHIFT).tolist()
            cv2.drawMarker(canvas, (u, v), _paler(colour, 0.7), cv2.MARKER_CROSS, 18, 2, cv2.LINE_AA)

    def _draw_mock_up(self, canvas: Picture, name: str, track: Track, pose: Array, t_s: float) -> None:
        half_m, colour = self._run.rig.half_width_m(name), self._colours[name]
        table_from_body = _rotation(pose[2])
        for position, direction in self._firing(name, track, t_s):
            across = np.array([-direction[1], direction[0]]) * 0.3 * _FLAME_M
            flame = np.array(
                [position, position - _FLAME_M * direction + across, position - _FLAME_M * direction - across]
            )
            cv2.fillPoly(
                canvas, [self._pixels(flame @ table_from_body.T + pose[:2])], _FLAME, cv2.LINE_AA, _SHIFT
            )
        corners = (
            half_m * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float) @ table_from_body.T + pose[:2]
        )
        cv2.fillPoly(canvas, [self._pixels(corners)], _paler(colour, 0.35), cv2.LINE_AA, _SHIFT)
        self._lines(canvas, corners, colour, 2, closed=True)
        nose = np.array([[0.0, 0.0], [1.35 * half_m, 0.0]]) @ table_from_body.T + pose[:2]
        self._lines(canvas, nose, colour, 3)
        u, v = (self._pixels(pose[None, :2])[0] >> _SHIFT).tolist()
        _write(canvas, name, (u - 4 * len(name), v - round(1.6 * half_m * self._scale)), _INK)

    def _firing(self, name: str, track: Track, t_s: float) -> list[tuple[Array, Array]]:
        """Where in the body a valve is open, and which way it pushes."""
        rows = track.on_times
        place = int(np.searchsorted(rows[:, 0], t_s, "right")) - 1
        valves = self._run.rig.valves.get(name)
        if place < 0 or valves is None:
            return []
        age_s = t_s - rows[place, 0]
        layout = square_of_eight(valves.arm_m, valves.thrust_n)
        return [
            (np.array(valve.position_body_m), np.array(valve.direction_body))
            for valve, left_s in zip(layout, rows[place, 1:], strict=False)
            if left_s > age_s
        ]

    def _draw_words(self, canvas: Picture, t_s: float) -> None:
        base = self.size_px[1] - _STRIP_PX
        modes = [f"{name}: {mode_at(track, t_s)}" for name, track in self._run.tracks.items()]
        _write(canvas, f"{t_s:7.1f} s   {'   '.join(modes)}", (10, base + 20), _INK)
        now = [mark for mark in self._run.marks if 0.0 <= t_s - mark.t_s <= _SHOWN_S]
        if now:
            _write(canvas, _words(now[-1]), (10, base + 42), _WARN)


def pose_at(rows: Array, t_s: float) -> Array | None:
    """x, y (m) and heading (rad) at a moment; None before the first and long after the last row."""
    if not len(rows) or t_s < rows[0, 0] or t_s > rows[-1, 0] + 1.0:
        return None
    place = int(np.searchsorted(rows[:, 0], t_s, "right")) - 1
    after = min(place + 1, len(rows) - 1)
    span_s = rows[after, 0] - rows[place, 0]
    share = min((t_s - rows[place, 0]) / span_s, 1.0) if span_s > 0.0 else 0.0
    turn = math.remainder(rows[after, 3] - rows[place, 3], math.tau)
    xy = rows[place, 1:3] + share * (rows[after, 1:3] - rows[place, 1:3])
    return np.array([*xy, rows[place, 3] + share * turn])


def mode_at(track: Track, t_s: float) -> str:
    """The mode of a vehicle at a moment."""
    known: Mapping[float, str] = dict(track.modes)
    before = [since_s for since_s in known if since_s <= t_s]
    return known[max(before)] if before else "unknown"


def _words(mark: Mark) -> str:
    text = f"{mark.vehicle}: {mark.text}" if mark.vehicle else mark.text
    return f"{mark.kind}  {text}"[:110]


def _rotation(angle_rad: float) -> Array:
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[cosine, -sine], [sine, cosine]])


def _paler(colour: Colour, strength: float) -> Colour:
    blue, green, red = (round(255 - (255 - part) * strength) for part in colour)
    return blue, green, red


def _write(canvas: Picture, text: str, place: tuple[int, int], colour: Colour) -> None:
    plain = text.encode("ascii", "replace").decode()  # the fonts of OpenCV have no others
    cv2.putText(canvas, plain, place, cv2.FONT_HERSHEY_SIMPLEX, 0.48, colour, 1, cv2.LINE_AA)
