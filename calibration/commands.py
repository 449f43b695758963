"""THE TABLE of what can be calibrated: a row per ``groundstation calibrate <what>``."""

from groundstation.cli.command import Command, Group

CALIBRATE = Group(
    "From recordings to calibration numbers.",
    "groundstation calibrate zero-offset try/rest --out rest.toml",
    {
        "zero-offset": Command("calibration.imu.commands:zero_offset", "IMU: offsets from a rest."),
        "zero-offset-fit": Command(
            "calibration.imu.commands:zero_offset_fit", "IMU: offsets (mu, nu) from a stretch of flight."
        ),
        "temperature": Command(
            "calibration.imu.commands:temperature", "IMU: slopes of the offsets from a rest that warms up."
        ),
        "gyro-scale": Command(
            "calibration.imu.commands:gyro_scale", "IMU: scale of the gyro by turns against the stars."
        ),
        "tilt": Command(
            "calibration.imu.commands:tilt", "IMU: scale and axes of the accelerometers by tilting."
        ),
        "allan": Command("calibration.imu.commands:allan", "IMU: white noise and bias instability."),
        "joint": Command(
            "calibration.imu.commands:joint", "IMU: every constant of a mock-up at once from one flight."
        ),
        "imu": Command("calibration.guided_commands:imu", "IMU: a running vehicle, step by step."),
        "guided": Command(
            "calibration.guided_commands:guided", "A running vehicle, step by step, by any installed wizard."
        ),
        "table-map": Command(
            "calibration.table.commands:table_map", "Table: slope and waves from flights, how to level it."
        ),
        "laboratory": Command(
            "calibration.laboratory.commands:laboratory", "Emulated laboratory: fitted to an ordinary flight."
        ),
        "survey": Command("calibration.sky.commands:survey", "Sky: the star list from a sweep."),
        "amend": Command(
            "calibration.sky.commands:amend", "Sky: the star list brought up to date by a flight."
        ),
        "lens": Command("calibration.sky.commands:lens", "Star camera: lens by the stars."),
        "board": Command("calibration.sky.commands:board", "Any camera: lens by a printed board."),
        "mount": Command("calibration.sky.commands:mount", "Star camera: offset, tilt and yaw on the body."),
        "delay": Command("calibration.sky.commands:delay", "Star camera: delay against the IMU."),
        "overhead": Command(
            "calibration.overhead.commands:overhead", "Overhead camera: where it hangs, by a board."
        ),
    },
)
