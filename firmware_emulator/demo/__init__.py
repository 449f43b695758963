"""THE TABLE of demo data: small folders of every kind that commands take, made by the emulator."""

from drivers.laboratory.demo_data import DemoKind
from firmware_emulator.demo import boards, flights, skies

KINDS = (
    DemoKind(
        "ceiling",
        "pictures of a ceiling of LEDs from many places",
        (
            "star-tracker solve {here} --out {here}/answers.csv",
            "star-tracker solve {here} --out {here}/published.csv --method published",
        ),
        skies.ceiling,
    ),
    DemoKind(
        "sweep",
        "overlapping pictures of an unknown ceiling, and two stars measured by tape",
        ("star-tracker survey {here} --out {here}/ceiling.csv --camera-out {here}/found.json",),
        skies.sweep,
    ),
    DemoKind(
        "turn",
        "pictures made by turning in place under a known ceiling",
        (
            "calibrate mount {here} --out {here}/mount.toml --first-heading-deg 0",
            "calibrate lens {here} --out {here}/lens.toml --wobble-mm 0.1",
        ),
        skies.turn,
    ),
    DemoKind(
        "board",
        "pictures of a printed chessboard",
        ("calibrate board {here} --squares 9x6 --square-mm 30 --out {here}/lens.toml",),
        boards.chessboard,
    ),
    DemoKind(
        "from_above",
        "pictures of two mock-ups by the camera over the table",
        ("star-tracker overhead {here} --out {here}/answers.csv",),
        boards.from_above,
    ),
    DemoKind(
        "board_on_table",
        "pictures of a board that lies on the table, and its places by tape",
        ("calibrate overhead {here} --out {here}/pose.toml --camera-out {here}/found.json",),
        boards.on_table,
    ),
    DemoKind(
        "rest",
        "two minutes of an IMU at rest that warms up",
        (
            "calibrate zero-offset {here} --out {here}/offsets.toml",
            "calibrate allan {here} --out {here}/noise.toml --plot {here}/noise.png",
            "calibrate temperature {here} --out {here}/slopes.toml",
        ),
        flights.rest,
    ),
    DemoKind(
        "flight",
        "a rest, then a flight that turns, with late star fixes",
        (
            "fusion run {here} --out {here}/estimate.csv",
            "fusion run {here} --out {here}/smoothed.csv --smooth",
            "calibrate zero-offset-fit {here} --start-s 20 --end-s 40 --out {here}/fit.toml",
            "calibrate gyro-scale {here} --out {here}/scale.toml",
            "calibrate delay {here} --out {here}/delay.toml --guess-s 0.6",
            "calibrate joint {here} --out {here}/joint.toml",
        ),
        flights.flight,
    ),
)
