"""The study of video navigation with differential evolution: its figures and tables, one row each."""

from __future__ import annotations

from groundstation.studies.evolution import cubesats, stage, stage_figures
from groundstation.studies.study import FigureRow, Study

DIFFERENTIAL_EVOLUTION = Study(
    name="differential-evolution",
    title="Accuracy of a video navigation algorithm",
    source=(
        "After S. P. Simakov, E. V. Ustyugov, Samara State Aerospace University, Engineering Journal: "
        "Science and Innovation, 2016, issue 7."
    ),
    sources={"stage": stage.STAGE_RUNS, "CubeSats": cubesats.SEPARATION},
    figures=(
        FigureRow(
            (2,),
            "regular precession of the stage",
            "Formulas (1) for H = 380 km, In = 14406, Ix = 2548 kg m^2, w = (-2.5, 1, 1) deg/s; results are "
            "not printed.",
            (),
            stage_figures.draw_precession,
        ),
        FigureRow(
            (3,),
            "distribution of the errors of the stage's rates",
            "Three histograms of 500 runs.",
            ("stage",),
            stage_figures.draw_histograms,
            stage.ASSUMED,
        ),
        FigureRow(
            (1,),
            "moments of the errors of the stage's rates",
            "M = 0.10, 0.20, 0.14 deg/s; D = 3.5e-5, 1.17e-4, 6.3e-5 deg^2/s^2; sigma = 0.012, 0.010, 0.021 "
            "deg/s.",
            ("stage",),
            stage_figures.draw_table,
            stage.ASSUMED,
            kind="table",
        ),
        FigureRow(
            (5, 6),
            "angles of the second CubeSat and their errors",
            "Curves over 0 to 10 s after two CubeSats have parted; accuracy falls with the distance.",
            ("CubeSats",),
            cubesats.draw_angles,
            cubesats.ASSUMED,
        ),
        FigureRow(
            (2,),
            "errors of the angles",
            "Largest and mean errors: phi 0.08 and 0.035, psi 0.09 and 0.080, theta 0.06 and 0.040 rad.",
            ("CubeSats",),
            cubesats.draw_table,
            cubesats.ASSUMED,
            kind="table",
        ),
    ),
    not_drawn={
        "Figure 1": "a diagram of the algorithm: it is the code",
        "Figure 4": "markers in a frame, without numbers",
    },
    about="Both sides were given the same pixels. t = 0 is the separation.",
)
