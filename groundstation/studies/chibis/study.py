"""The study of the Chibis-M: its figures, one row each."""

from __future__ import annotations

from groundstation.studies.chibis import condition, orbits, video, working_time
from groundstation.studies.chibis.orbits import draw_orbits
from groundstation.studies.chibis.robustness import draw_reference_points
from groundstation.studies.chibis.simulation import SIMULATION
from groundstation.studies.chibis.simulation_figures import draw_course, draw_errors
from groundstation.studies.chibis.video import FILM
from groundstation.studies.chibis.video_figures import draw_frames, draw_motion
from groundstation.studies.chibis.working_time import WORKING_TIMES, draw_working_time
from groundstation.studies.study import FigureRow, Study

CHIBIS = Study(
    name="chibis",
    title="Relative motion of satellites at separation by processing of video",
    source=(
        "After D. S. Ivanov, S. O. Karpenko, M. Yu. Ovchinnikov, Keldysh Institute of Applied Mathematics, "
        "preprint 57, Moscow 2012; the microsatellite Chibis-M leaves the cargo craft Progress on 25 "
        "January 2012."
    ),
    sources={"simulation": SIMULATION, "working times": WORKING_TIMES, "film": FILM},
    figures=(
        FigureRow(
            ("2.1", "2.2"),
            "relative orbits",
            "Examples with C1 = 0 and C1 = 0.05: a closed ellipse, and one that wanders.",
            (),
            draw_orbits,
            orbits.ASSUMED,
        ),
        FigureRow(
            ("2.6", "2.7", "2.8"),
            "a picture, its boundaries, its reference points; what happens with wrong settings",
            "A modelled picture, all boundaries, and the points found in an eps-neighbourhood of their "
            "prediction. Wrong eps, start, inertia or orbit may lose the target; no numbers.",
            ("simulation",),
            draw_reference_points,
            (*condition.ASSUMED, "how wrong they are: the publication gives no numbers"),
        ),
        FigureRow(
            ("2.10", "2.11"),
            "position and attitude over time",
            "Curves without values.",
            ("simulation",),
            draw_course,
            condition.ASSUMED,
        ),
        FigureRow(
            ("2.12", "2.13", "2.14"),
            "errors, and what is propagated after the tips are lost",
            "0.01 m at 3 m, 0.4 m near 15 m, at most 4 deg at 15 m; growth near exponential; at 15 m tips "
            "are smaller than a pixel, and the propagated state leaves the true one.",
            ("simulation",),
            draw_errors,
            condition.ASSUMED,
        ),
        FigureRow(
            ("2.15",),
            "working time against the size of the points, and against the camera",
            "A curve without values: working time falls with the size of the points, and a critical size "
            "exists; focal length, field of view and chip matter likewise.",
            ("working times",),
            draw_working_time,
            (*condition.ASSUMED, *working_time.ASSUMED),
        ),
        FigureRow(
            ("3.3", "3.4", "3.5"),
            "frames of the film",
            "A frame of the real film, its binary picture, first guess and estimate of the reference points.",
            ("film",),
            draw_frames,
            video.ASSUMED,
        ),
        FigureRow(
            ("3.6", "3.7"),
            "motion by the film",
            "About 100 frames in three seconds, then glare; V = (0.12, 0.00, 0.27) m/s, rate (-2.08, -3.01, "
            "2.15) deg/s with the length 4.24; a gyro measured 4.5 half a minute later.",
            ("film",),
            draw_motion,
            video.ASSUMED,
        ),
    ),
    not_drawn={
        "Figures 1.1 to 1.5, 2.5, 3.1": "photographs and drawings of craft",
        "Figures 2.3, 2.4, 3.2": "drawings of axes: docs/relative_navigation.md describes them",
        "Figure 2.9": "a sketch of one point between two frames; figure 3.5 shows the same with four",
    },
    about="Both sides were given the same pictures. t = 0 is the first frame.",
)
