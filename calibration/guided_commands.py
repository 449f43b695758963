"""`groundstation calibrate guided`, and its older spelling `calibrate imu --guided`."""

from pathlib import Path
from typing import Annotated

import typer

from calibration.wizards import lead
from groundstation.declarations.errors import UsageError

RigFile = Annotated[Path, typer.Argument(help="Rig file of the run that is going on.")]
Out = Annotated[Path, typer.Option(help="TOML to write.")]
Vehicle = Annotated[str | None, typer.Option(help="Name of the vehicle; the rig's first if not given.")]
Drive = Annotated[
    bool, typer.Option("--drive", help="Also send the requests: land, float, turn, fly to and fro.")
]


def imu(
    rig: RigFile,
    out: Out,
    guided: Annotated[bool, typer.Option("--guided", help="Say step by step what to do.")] = False,
    vehicle: Vehicle = None,
    drive: Drive = False,
) -> None:
    """IMU of a running vehicle, step by step: rest, turns, flights, until there is enough data.

    Example: groundstation calibrate imu examples/rigs/drawn_fixes.toml --guided --drive --out imu.toml
    """
    if not guided:
        raise UsageError(
            "the IMU is calibrated step by step: give --guided (recordings: see `calibrate joint`)."
        )
    lead("imu", rig, vehicle, out, is_driven=drive)


def guided(
    wizard: Annotated[str, typer.Argument(help="What to calibrate: imu, or what a package adds.")],
    rig: RigFile,
    out: Out,
    vehicle: Vehicle = None,
    drive: Drive = False,
) -> None:
    """Guided calibration of a running vehicle; an installed package can add others.

    Example: groundstation calibrate guided imu examples/rigs/published_condition.toml --drive --out imu.toml
    """
    lead(wizard, rig, vehicle, out, is_driven=drive)
