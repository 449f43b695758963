"""The study of the air table: its figures, one row each."""

from __future__ import annotations

from groundstation.studies.air_table.inertial import draw_accelerations, draw_imu_alone, draw_rate
from groundstation.studies.air_table.joint import draw_joint
from groundstation.studies.air_table.offsets import draw_offset_fit
from groundstation.studies.air_table.rigs import FLIGHTS
from groundstation.studies.air_table.stars import draw_perimeter, draw_rest, draw_sky
from groundstation.studies.study import FigureRow, Study

_CAMERA = (
    "ceiling height, LED layout and brightness, lens, exposure: those of the emulated laboratory",
    "level of the picture steps 0.45, angles alike within 0.3 deg, places close within 5 mm, vertices "
    "paired by angle, closeness along x and y, heading from the maps; level and limits were chosen such "
    "that about one try in six fails",
)
_IMU = (
    "100 samples a second, each the mean of ten polls; noise as published and white; zeros, temperature "
    "slopes and the table's slope (0.3 mrad with waves) as emulated",
    "the angle of a sample is that at its end; d after a sample that was left out counts from the last "
    "used one",
)
_FLIGHT = (
    "speed 0.04 m/s and a way of 2.0 by 1.6 m; mock-up of 11 kg, eight valves of 0.22 N",
)  # fmt: skip
_PULSES = ("way, turn and times: the publication shows curves without values",)

AIR_TABLE = Study(
    name="air-table",
    title="Mock-up position and orientation by inertial sensors and a star tracker",
    source=(
        "After D. Bindel, D. S. Ivanov, D. O. Nuzhdin, M. Yu. Ovchinnikov, S. P. Trofimov, a preprint of "
        "the Keldysh Institute of Applied Mathematics, Moscow; experiments on the air table of ZARM, "
        "Bremen."
    ),
    sources=FLIGHTS,
    figures=(
        FigureRow(
            (4,),
            "the triangulated sky",
            "An example of a triangulation; 180 LEDs gave a catalogue of 322 triangles.",
            (),
            draw_sky,
            ("where the LEDs hang",),
        ),
        FigureRow(
            (8, 9),
            "about the perimeter by stars",
            "A track at constant speed with grey arrows of velocity and asterisks where determination "
            "failed; a fix takes 0.6 s, 0.72 s in the mean, 2.7 s at worst, visibly quantised.",
            ("perimeter",),
            draw_perimeter,
            (*_CAMERA, *_FLIGHT),
        ),
        FigureRow(
            (10,),
            "one coordinate at rest",
            "About one millimetre at best.",
            ("rest",),
            draw_rest,
            _CAMERA,
        ),
        FigureRow(
            (13,),
            "acceleration with control pulses and shocks",
            "Control pulses of 0.04 m/s^2 in the noise, and very short spikes of 0.07 m/s^2 about every "
            "second.",
            ("pulses",),
            draw_accelerations,
            (*_IMU, *_PULSES, "width of a spike, 20 ms, and that they push the mock-up"),
        ),
        FigureRow(
            (14,),
            "turn rate with two control pulses",
            "Two control actions; no values.",
            ("pulses",),
            draw_rate,
            (*_IMU, *_PULSES),
        ),
        FigureRow(
            (15, 16, 17),
            "the IMU alone beside the stars",
            "Headings agree but for a lag of 0.6 s; velocities by stars are much noisier; positions drift "
            "apart, since a zero that is off by 0.001 m/s^2 makes 0.05 m in 10 s.",
            ("pulses",),
            draw_imu_alone,
            (
                *_IMU,
                *_PULSES,
                "known initial conditions: the last fix of the rest; zeros that a disturbance of the rest "
                "put off",
            ),
        ),
        FigureRow(
            (18, 19),
            "zero offsets by least squares",
            "alpha = 0.005, beta = -0.004 m/s^2 for the experiment of figures 15 to 17; over 20 s no "
            "constant pair gives sufficient agreement.",
            ("pulses",),
            draw_offset_fit,
            (
                *_IMU,
                *_PULSES,
                "a disturbance in the rest, of a size that puts the zeros off by the published values; a "
                "turn of 100 degrees from 11.5 s on; length of the first experiment, 10 s; k(i) the "
                "nearest sample; the sign",
            ),
        ),
        FigureRow(
            (21, 22, 23, 24),
            "the joint method beside stars alone",
            "The difference of positions is mostly within 5 cm, except for a few outliers; that of "
            "velocities without a number.",
            ("perimeter",),
            draw_joint,
            (
                *_CAMERA,
                *_IMU,
                *_FLIGHT,
                "rough start at the table's origin; the star curve is not shifted by its lag",
            ),
        ),
    ),
    not_drawn={
        "Figures 1, 2, 7, 12": "photographs of the table, of coloured circles, of the webcam, of the block",
        "Figures 3, 6, 11, 20": "diagrams of the algorithms: they are the code",
        "Figure 5": "an example of a star field, without numbers",
    },
    about=(
        "Both sides were flown in a closed loop, so their ways differ a little. t = 0 is when the flight "
        "begins."
    ),
)
