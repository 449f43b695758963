"""The table from above, to scale: trails, headings, where mock-ups began and ended, where things happened."""

import math

import numpy as np

from groundstation.watch.page import svg
from groundstation.watch.page.decimation import without_repeats
from groundstation.watch.page.panel import round_ticks, tick_word
from groundstation.watch.page.subject import Drawn, Subject
from groundstation.watch.tracks import Array, Track

PLOT_WIDTH, TALLEST = 780.0, 620.0
LEFT, TOP = 52.0, 14.0
AROUND_M = 0.25
"""Shown beyond the edges of the table."""
TICK_M = 0.09
MOST_TICKS = 40
APART = 13.5
"""Pixels between the numbers of events."""
TICK_MOVE_M, TICK_TURN_RAD = 0.04, math.radians(12.0)
"""Less than this since the last heading tick gives no new one."""


def draw_plan(subject: Subject) -> str:
    """The picture."""
    return _Plan(subject).draw()


class _Plan:
    def __init__(self, subject: Subject) -> None:
        self._subject = subject
        self._trails = [(drawn, trail(drawn.track)) for drawn in subject.drawn()]
        table = subject.run.rig.table_m
        x = np.concatenate([rows[:, 1] for _, rows in self._trails])
        y = np.concatenate([rows[:, 2] for _, rows in self._trails])
        x_low, x_high, y_low, y_high = table or (x.min() - 0.3, x.max() + 0.3, y.min() - 0.3, y.max() + 0.3)
        self._table = table
        self._low = np.array([min(x_low, x.min()) - AROUND_M, min(y_low, y.min()) - AROUND_M])
        self._high = np.array([max(x_high, x.max()) + AROUND_M, max(y_high, y.max()) + AROUND_M])
        size = self._high - self._low
        self._scale = min(PLOT_WIDTH / size[0], TALLEST / size[1])
        self._size = size * self._scale

    def _at(self, x: Array | float, y: Array | float) -> tuple[Array, Array]:
        """Pixels of places on the table."""
        across = LEFT + (np.asarray(x) - self._low[0]) * self._scale
        return across, TOP + (self._high[1] - np.asarray(y)) * self._scale

    def _place(self, x: float, y: float) -> tuple[float, float]:
        across, down = self._at(x, y)
        return float(across), float(down)

    def draw(self) -> str:
        parts = [*self._frame(), *self._obstacles()]
        for drawn, rows in self._trails:
            parts.append(svg.group(self._vehicle(drawn, rows), drawn.kind))
        parts += self._events()
        bottom = TOP + self._size[1]
        entries = [(drawn.kind, drawn.words) for drawn, _ in self._trails]
        y = bottom + 38.0
        for kind, words in entries:
            parts.append(svg.line(LEFT, y - 4, LEFT + 20, y - 4, f"line {kind}"))
            parts.append(svg.text(LEFT + 26, y, words, "legend"))
            y += 15.0
        width = LEFT + self._size[0] + 14.0
        return svg.picture(parts, width, y - 6.0, "The table from above")

    def _frame(self) -> list[str]:
        right, bottom = LEFT + self._size[0], TOP + self._size[1]
        parts = [svg.rectangle(LEFT, TOP, right - LEFT, bottom - TOP, "ground")]
        if self._table is not None:
            (x1, y1), (x2, y2) = (
                self._at(self._table[0], self._table[3]),
                self._at(self._table[1], self._table[2]),
            )
            parts.append(svg.rectangle(float(x1), float(y1), float(x2 - x1), float(y2 - y1), "table"))
        for tick in round_ticks(self._low[0], self._high[0], 10):
            x = float(self._at(tick, 0.0)[0])
            parts += [
                svg.line(x, TOP, x, bottom, "grid"),
                svg.text(x, bottom + 14, tick_word(tick), "tick", "middle"),
            ]
        for tick in round_ticks(self._low[1], self._high[1], 8):
            y = float(self._at(0.0, tick)[1])
            parts += [
                svg.line(LEFT, y, right, y, "grid"),
                svg.text(LEFT - 5, y + 3.5, tick_word(tick), "tick", "end"),
            ]
        parts.append(svg.text(right, bottom + 27, "x, m", "tick", "end"))
        parts.append(svg.text(13, (TOP + bottom) / 2, "y, m", "label", "middle", turn=-90.0))
        return parts

    def _obstacles(self) -> list[str]:
        verdict = self._subject.verdict
        places = verdict.obstacles if verdict is not None else ()
        return [
            svg.circle(*self._place(x_m, y_m), radius_m * self._scale, "obstacle")
            for x_m, y_m, radius_m in places
        ]

    def _vehicle(self, drawn: Drawn, rows: Array) -> list[str]:
        x, y = without_repeats(*self._at(rows[:, 1], rows[:, 2]), step=0.5)
        parts = [svg.path(svg.way(x, y), "line trail")]
        ticks = heading_ticks(rows)
        data = ""
        for at_x, at_y, heading in rows[ticks, 1:4].tolist():
            tip = at_x + TICK_M * math.cos(heading), at_y + TICK_M * math.sin(heading)
            data += svg.way(*self._at(np.array([at_x, tip[0]]), np.array([at_y, tip[1]])))
        parts.append(svg.path(data, "line thin"))
        half_m = drawn.run.rig.half_width_m(drawn.name)
        parts.append(svg.path(self._outline(rows[0, 1:4], half_m), "line hull start"))
        parts.append(svg.path(self._outline(rows[-1, 1:4], half_m), "line hull"))
        if len(drawn.track.goal):
            goal_x, goal_y = self._place(*drawn.track.goal[-1, 1:3].tolist())
            cross = f"M{svg.number(goal_x - 6)} {svg.number(goal_y)}h12m-6-6v12"
            parts.append(svg.path(cross, "line goal"))
        return parts

    def _outline(self, pose: Array, half_m: float) -> str:
        """A square, and a line from its centre to beyond the face that looks along the heading."""
        x, y, heading = pose.tolist()
        corners = half_m * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]], float)
        cosine, sine = math.cos(heading), math.sin(heading)
        turned = corners @ np.array([[cosine, sine], [-sine, cosine]]) + (x, y)
        ahead = np.array([[x, y], [x + 1.3 * half_m * cosine, y + 1.3 * half_m * sine]])
        return svg.way(*self._at(*turned.T)) + svg.way(*self._at(*ahead.T))

    def _events(self) -> list[str]:
        """Numbers where the vehicle was that something befell."""
        rows_of = {drawn.name: rows for drawn, rows in self._trails if drawn.run is self._subject.run}
        parts: list[str] = []
        taken: list[tuple[float, float]] = []
        for index, mark in enumerate(self._subject.marks, start=1):
            rows = rows_of.get(mark.vehicle)
            if rows is None:
                continue
            x, y = (float(np.interp(mark.t_s, rows[:, 0], rows[:, axis])) for axis in (1, 2))
            across, down = self._place(x, y)
            while any(math.dist((across, down), place) < APART for place in taken):  # beside what is there
                across += APART
            taken.append((across, down))
            parts.append(svg.circle(across, down, 6.5, f"event {mark.kind}"))
            parts.append(svg.text(across, down + 3, str(index), "event-number", "middle"))
        return parts


def trail(track: Track) -> Array:
    """Where a vehicle was, by truth where there is any: rows of t, x, y, heading; shape (n, 4)."""
    if len(track.truth):
        return track.truth
    return track.state[:, :4]


def heading_ticks(rows: Array) -> list[int]:
    """Rows at which the heading is shown: evenly in time, where it moved or turned since the last."""
    chosen: list[int] = []
    for index in np.linspace(0, len(rows) - 1, MOST_TICKS).astype(int).tolist():
        if chosen:
            moved_m = math.dist(rows[index, 1:3], rows[chosen[-1], 1:3])
            turned_rad = abs(math.remainder(rows[index, 3] - rows[chosen[-1], 3], math.tau))
            if moved_m < TICK_MOVE_M and turned_rad < TICK_TURN_RAD:
                continue
        chosen.append(index)
    return chosen
