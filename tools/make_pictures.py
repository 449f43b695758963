"""Draw the README's picture: fly examples/fly_a_square.py in lockstep and show what happened.

    python tools/make_pictures.py --duration 104

Everything in the picture comes out of the run: the trails are the reference's, the frame is the last one that
the star camera delivered, the names of the stars are the star tracker's answer to it.
"""

import argparse
import math
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle
from numpy.typing import NDArray

from firmware_emulator.sky.scene import read_camera
from groundstation.bus.envelope import Delivered
from groundstation.control.vehicle import square_of_eight
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.stars.messages import StarImage
from groundstation.parts.valves.messages import ValveCommand
from groundstation.rig.read import load_rig
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots, detect
from groundstation.star_tracking.fixes import PictureFix
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker

Array = NDArray[np.float64]
ROOT = Path(__file__).parent.parent
CALIBRATION = ROOT / "calibration" / "rigs" / "emulated"
COLOURS = {"alpha": "#4aa3ff", "beta": "#ff8a5c"}
NIGHT, PLATE, INK, STAR = "#0d1420", "#1a2536", "#c9d4e3", "#ffe9a8"
TABLE_M = (-2.0, 2.0, -1.5, 1.5)
BODY_HALF_M = 0.15
PLUME_M = 0.16


@dataclass(slots=True)
class Flight:
    """An observer that keeps what the picture needs."""

    truth: dict[str, list[tuple[float, ...]]] = field(default_factory=dict)
    state: dict[str, list[tuple[float, ...]]] = field(default_factory=dict)
    images: dict[str, StarImage] = field(default_factory=dict)
    open_mask: dict[str, int] = field(default_factory=dict)

    def __call__(self, delivered: Delivered, now_ns: int) -> None:
        """Take one message."""
        del now_ns
        reported = delivered.payload
        t_s = reported.stamp_ns * 1e-9
        match reported:
            case ReferenceState():
                self.truth.setdefault(reported.vehicle, []).append(
                    (t_s, *reported.position_table_m, reported.heading_rad)
                )
            case VehicleState(status="flying"):
                row = (t_s, *reported.position_table_m, reported.heading_rad, *reported.pose_sigma)
                self.state.setdefault(reported.vehicle, []).append(row)
            case StarImage():
                self.images[reported.vehicle] = reported
            case ValveCommand():
                self.open_mask[reported.vehicle] = reported.open_mask


def to_table(pose: Array, points_body_m: Array) -> Array:
    """Points of the body (n, 2) in the table, for a pose x, y, heading."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return np.asarray(points_body_m @ np.array([[c, s], [-s, c]]) + pose[:2])


def draw_table(axes: Axes, flight: Flight, catalogue: StarCatalogue, seen: NDArray[np.int64]) -> None:
    """The table from above: plate, stars of the ceiling, trails, mock-ups, what alpha's camera sees."""
    left, right, low, high = TABLE_M
    axes.add_patch(Rectangle((left, low), right - left, high - low, fc=PLATE, ec="#3a4a61", lw=1.5))
    axes.scatter(catalogue.x_m, catalogue.y_m, s=5, color=INK, alpha=0.4, lw=0, zorder=2)
    axes.scatter(catalogue.x_m[seen], catalogue.y_m[seen], s=16, color=STAR, lw=0, zorder=3)
    optics = read_camera(CALIBRATION / "camera.json")
    width, height = optics.width_px - 1, optics.height_px - 1
    edge = np.concatenate(
        [
            np.column_stack([np.linspace(0, width, 30), np.zeros(30)]),
            np.column_stack([np.full(30, width), np.linspace(0, height, 30)]),
            np.column_stack([np.linspace(width, 0, 30), np.full(30, height)]),
            np.column_stack([np.zeros(30), np.linspace(height, 0, 30)]),
        ]
    )
    view, _ = optics.ceiling_in_body(edge)
    for name, rows in flight.truth.items():
        path, colour = np.array(rows), COLOURS[name]
        segments = np.stack([path[:-1, 1:3], path[1:, 1:3]], axis=1)
        fading = [(*to_rgba(colour)[:3], alpha) for alpha in np.linspace(0.08, 0.9, len(segments))]
        axes.add_collection(LineCollection(list(segments), colors=fading, lw=1.8, zorder=4))
        pose = path[-1, 1:4]
        if name == "alpha":
            outline = Polygon(to_table(pose, view[:, :2]), fc=STAR, ec=STAR, alpha=0.07, lw=0, zorder=2)
            axes.add_patch(outline)
            axes.add_patch(
                Polygon(to_table(pose, view[:, :2]), fill=False, ec=STAR, alpha=0.5, lw=0.8, zorder=3)
            )
        draw_mock_up(axes, pose, colour, flight.open_mask.get(name, 0))
        axes.annotate(
            name, (pose[0], pose[1]), xytext=(0, -34), textcoords="offset points", color=colour, ha="center"
        )
    axes.set_xlim(-2.35, 2.35)
    axes.set_ylim(-1.85, 1.85)
    axes.set_aspect("equal")
    axes.set_xlabel("table x, m")
    axes.set_ylabel("table y, m")


def draw_mock_up(axes: Axes, pose: Array, colour: str, open_mask: int) -> None:
    """Outline to scale, nose, and a plume at each open valve."""
    h, cut = BODY_HALF_M, 0.05
    corners = [
        (h, h - cut),
        (h - cut, h),
        (cut - h, h),
        (-h, h - cut),
        (-h, cut - h),
        (cut - h, -h),
        (h - cut, -h),
    ]
    outline = np.array([*corners, (h, cut - h)])
    axes.add_patch(Polygon(to_table(pose, outline), fc=NIGHT, ec=colour, lw=2, zorder=6))
    nose = to_table(pose, np.array([(0.09, 0.0), (-0.03, 0.05), (-0.03, -0.05)]))
    axes.add_patch(Polygon(nose, fc=colour, ec="none", zorder=7))
    for index, valve in enumerate(square_of_eight(BODY_HALF_M, 0.22)):
        if not open_mask >> index & 1:
            continue
        place, push = np.array(valve.position_body_m), np.array(valve.direction_body)
        side = np.array([-push[1], push[0]]) * 0.03
        plume = np.array([place, place - PLUME_M * push + side, place - PLUME_M * push - side])
        axes.add_patch(Polygon(to_table(pose, plume), fc="#e8f4ff", ec="none", alpha=0.75, zorder=5))


def draw_frame(
    axes: Axes, image: NDArray[np.uint8], spots: Spots, fix: PictureFix, names: tuple[str, ...]
) -> None:
    """The camera's frame with the stars that the tracker named."""
    bright = np.clip((image.astype(float) - spots.background_dn + 6.0) / 110.0, 0.0, 1.0) ** 0.6
    axes.imshow(bright, cmap="gray", vmin=0.0, vmax=1.0, interpolation="nearest")
    for spot, star in zip(fix.spot_index, fix.star_index, strict=True):
        u, v = spots.u_px[spot], spots.v_px[spot]
        axes.add_patch(Circle((u, v), 8, fill=False, ec=STAR, lw=0.9))
        axes.annotate(names[star], (u + 9, v - 8), color=STAR, fontsize=6, annotation_clip=True)
    axes.set_xlim(-0.5, image.shape[1] - 0.5)
    axes.set_ylim(image.shape[0] - 0.5, -0.5)
    axes.set_xticks([])
    axes.set_yticks([])
    off_deg = math.degrees(fix.sigma_heading_rad)
    off = f"{fix.stars} stars, sigma {1e3 * fix.sigma_x_m:.3f} mm, {off_deg:.4f} deg"
    axes.set_title(f"Alpha's star camera: {off}", color=INK, fontsize=9)


def draw_errors(axes: Axes, flight: Flight) -> None:
    """Distance of the estimate from the truth over time, per mock-up."""
    for name, rows in flight.state.items():
        state, truth = np.array(rows), np.array(flight.truth[name])
        inside = (state[:, 0] >= truth[0, 0]) & (state[:, 0] <= truth[-1, 0])
        t_s = state[inside, 0]
        dx, dy = (state[inside, i] - np.interp(t_s, truth[:, 0], truth[:, i]) for i in (1, 2))
        axes.plot(t_s, 1e3 * np.hypot(dx, dy), color=COLOURS[name], lw=0.7, label=name)
    axes.set_ylim(0.0, None)
    axes.set_xlabel("t, s")
    axes.set_title("Estimate against truth, mm", color=INK, fontsize=9)


def compose(flight: Flight, path: Path) -> None:
    """Put the three panels together."""
    catalogue = StarCatalogue.load(CALIBRATION / "ceiling.csv")
    tracker = StarTracker(catalogue, CameraCalibration.load(CALIBRATION / "camera.json"))
    reported = flight.images["alpha"]
    image = np.frombuffer(reported.data, np.uint8).reshape(reported.height, reported.width)
    spots = detect(image)
    fix = tracker.solve(spots)
    assert isinstance(fix, PictureFix), fix
    figure = Figure(figsize=(13, 6.4), layout="constrained", facecolor=NIGHT)
    grid = figure.add_gridspec(2, 2, width_ratios=[1.75, 1], height_ratios=[3.2, 1])
    panels = [figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])]
    for axes in panels:
        axes.set_facecolor(NIGHT)
        axes.tick_params(colors=INK, labelsize=8)
        axes.xaxis.label.set_color(INK)
        axes.yaxis.label.set_color(INK)
        for spine in axes.spines.values():
            spine.set_color("#3a4a61")
    draw_table(panels[0], flight, catalogue, fix.star_index)
    panels[0].set_title(
        "The table from above; dots: ceiling lights carried down, bright: those that alpha identified",
        color=INK,
        fontsize=9,
    )
    draw_frame(panels[1], image, spots, fix, catalogue.ids)
    draw_errors(panels[2], flight)
    figure.savefig(path, dpi=110, facecolor=NIGHT)


def main() -> None:
    """Fly and draw."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "pictures" / "two_mock_ups.png")
    parser.add_argument("--duration", type=float, default=104.0, help="virtual seconds")
    arguments = parser.parse_args()
    sys.path.insert(0, str(ROOT / "examples"))
    import fly_a_square
    import waypoints

    flight = Flight()
    waypoints.fly(load_rig(fly_a_square.RIG), arguments.duration, fly_a_square.tours(), [flight])
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    compose(flight, arguments.out)
    print(arguments.out)


if __name__ == "__main__":
    main()
