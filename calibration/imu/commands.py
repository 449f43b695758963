"""`groundstation calibrate` for the IMU, from recordings and data folders."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from calibration.delivery import deliver, refusing
from calibration.flights import read_flight
from calibration.imu import joint as joint_procedure
from calibration.imu import noise, procedures
from calibration.imu import tilt as tilt_procedure
from calibration.outcome import Outcome
from calibration.result import provenance_of, provenance_of_several
from groundstation.cli.number_options import LONGEST_S
from groundstation.cli.plot_option import Plot
from groundstation.data_sets.inputs import inputs_of
from groundstation.declarations.errors import UsageError
from groundstation.files.writing import check_targets
from groundstation.fusion.flight_data import FlightData
from groundstation.fusion.table_map import TableMap

Source = Annotated[
    Path, typer.Argument(help="Recording (.mcap), or folder with imu.csv, meta.json (and stars.csv).")
]
Out = Annotated[Path, typer.Option(help="TOML to write.")]
Vehicle = Annotated[str | None, typer.Option(help="Of a recording with several vehicles.")]


def zero_offset(source: Source, out: Out, plot: Plot = None, vehicle: Vehicle = None) -> None:
    """Mean of the rest at the start, after a test that it was one.

    Example: groundstation calibrate zero-offset try/rest --out rest.toml
    """
    _calibrate(source, vehicle, procedures.offsets_at_rest, out, plot, with_stars=False)


def zero_offset_fit(
    source: Source,
    start_s: Annotated[float, typer.Option(help="Start of the stretch of flight.", min=0.0, max=LONGEST_S)],
    end_s: Annotated[float, typer.Option(help="End of the stretch of flight.", min=0.0, max=LONGEST_S)],
    out: Out,
    as_published: Annotated[
        bool,
        typer.Option("--as-published", help="The published least squares to the letter."),
    ] = False,
    plot: Plot = None,
    vehicle: Vehicle = None,
) -> None:
    """Least squares for the accelerometers' constant offsets (mu, nu) over a stretch of flight.

    It follows the published study, where they are called alpha and beta, with additions of ours: wrong fixes
    are left out, a packet is one of constant acceleration, and there are sigmas. --as-published is without
    them: the printed sums, every fix, the start state known (standing, where the stretch begins in the rest);
    its normal equations are solved with the sign that makes the squares least, the printed sign is in the
    notes. The publication found no constant pair that fits 20 s: offsets move, and a slope looks like one
    until the vehicle turns.

    Example: groundstation calibrate zero-offset-fit try/flight --start-s 20 --end-s 40 --out fit.toml
    """
    if not end_s > start_s:
        raise UsageError(f"--end-s must be after --start-s, found {start_s:g} and {end_s:g}.")
    chosen = procedures.offsets_as_published if as_published else procedures.offsets_of_stretch
    procedure = partial(chosen, start_s=start_s, end_s=end_s)
    _calibrate(source, vehicle, procedure, out, plot)


def temperature(source: Source, out: Out, plot: Plot = None, vehicle: Vehicle = None) -> None:
    """Temperature slopes of the gyro's null and the tilt offsets, from a long rest that warms up.

    Example: groundstation calibrate temperature try/rest --out temperature.toml
    """
    _calibrate(source, vehicle, procedures.temperature_slopes, out, plot, with_stars=False)


def gyro_scale(source: Source, out: Out, plot: Plot = None, vehicle: Vehicle = None) -> None:
    """Gyro scale by full turns against the stars.

    Example: groundstation calibrate gyro-scale try/flight --out scale.toml
    """
    _calibrate(source, vehicle, procedures.gyro_scale_by_turns, out, plot)


def allan(source: Source, out: Out, plot: Plot = None, vehicle: Vehicle = None) -> None:
    """Allan deviation: white noise, bias instability, from a long rest.

    White noise takes some seconds; a bias instability ten times the averaging time at which the curve turns
    up again: 17 min for a floor at 100 s. What the record is too short for is said, not printed.

    Example: groundstation calibrate allan try/rest --out noise.toml --plot noise.png
    """
    _calibrate(source, vehicle, noise.noise_at_rest, out, plot, with_stars=False)


def tilt(
    recordings: Annotated[list[Path], typer.Argument(help="Recordings (.mcap) or folders, rests inside.")],
    out: Out,
    tilts: Annotated[
        Path | None,
        typer.Option(help="CSV along_x_deg,along_y_deg: each axis above the horizontal, a row per rest."),
    ] = None,
    tilt_sigma_deg: Annotated[
        float, typer.Option(help="How sure those are (gauge blocks, their base).", min=1e-4, max=10.0)
    ] = 0.01,
    table_map: Annotated[Path | None, typer.Option(help="Map that says how the table pulls.")] = None,
    least_s: Annotated[float, typer.Option(help="Shorter rests are left out.", min=1.0, max=3600.0)] = 3.0,
    plot: Plot = None,
    vehicle: Vehicle = None,
) -> None:
    """Scale and axis misalignment of the accelerometers by tilting, or by turning on a tilted table.

    Either set the landed vehicle on gauge blocks, tilted along x and along y, both ways, and write the tilts
    down (--tilts). Or tilt the table by some mrad and land the vehicle at eight headings: the stars say them.
    Then the common scale and turn of both axes stay unknown unless --table-map states how the table pulls.
    Rests are found by themselves; knocks and touches in them are named and cut out.

    Example: groundstation calibrate tilt level.mcap tilted.mcap --tilts tilts.csv --out tilt.toml
    """
    check_targets(out, plot, sources=inputs_of(*recordings, tilts, table_map))
    known = None if table_map is None else TableMap.load(table_map)
    given = None if tilts is None else tilt_procedure.load_tilts(tilts)
    rests, notes = tilt_procedure.RestsFound(), []
    for path in recordings:
        data = read_flight(path, vehicle, with_stars=not (tilts is not None and path.is_dir()))
        notes += [f"{path.name}: {note}" for note in data.notes]
        with refusing(path, data.notes):
            rests += tilt_procedure.rests_of(path.name, data, least_s, known)
    with refusing(", ".join(path.name for path in recordings)):
        found = tilt_procedure.axes_of(rests, given, math.radians(tilt_sigma_deg), known)
    deliver(found, provenance_of_several(recordings), out, plot, aside=notes)


def joint(
    source: Annotated[
        Path, typer.Argument(help="Recording (.mcap), or folder with imu.csv, stars.csv and meta.json.")
    ],
    out: Out,
    plot: Plot = None,
    table_map: Annotated[
        Path | None, typer.Option(help="TOML to write the slope's map to, with its sigmas.")
    ] = None,
    vehicle: Vehicle = None,
) -> None:
    """Every constant of sensors, mounting, camera delay and slope from one recorded flight.

    A quantity that the flight did not excite keeps a wide sigma: turn for scale and lever arm, push along
    both axes for the accelerometers' scales, warm up for the temperature slopes. Turns give the lever arm of
    the IMU. With --table-map the slope by place comes from the same flight, fitted together with its biases,
    scales, lever arm and delay (`calibrate table-map` takes many flights and draws it).

    Example: groundstation calibrate joint try/flight --out joint.toml --plot residuals.png
    """
    from calibration.table.procedure import map_of_sources  # half of what is loaded, for one option
    from calibration.table.smoothed_flights import read_source

    grid = None if table_map is None else table_map.with_suffix(".npz")
    check_targets(out, plot, table_map, grid, sources=inputs_of(source))
    data = read_flight(source, vehicle)
    with refusing(source, data.notes):
        made = None if table_map is None else map_of_sources([read_source(source, None, vehicle)])[1]
        found = joint_procedure.constants_of_flight(data)
    also = {} if made is None or table_map is None else made.files(table_map)
    deliver(found, provenance_of(source), out, plot, also=also, aside=data.notes)


def _calibrate(
    source: Path,
    vehicle: str | None,
    procedure: Callable[[FlightData], Outcome],
    out: Path,
    plot: Path | None,
    *,
    with_stars: bool = True,
) -> None:
    check_targets(out, plot, sources=inputs_of(source))
    data = read_flight(source, vehicle, with_stars=with_stars)
    with refusing(source, data.notes):
        found = procedure(data)
    deliver(found, provenance_of(source), out, plot, aside=data.notes)
