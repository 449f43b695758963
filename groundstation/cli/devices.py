"""``groundstation devices``: asks every serial port who is there."""

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table
from serial.tools import list_ports

from drivers.imu_block.identify import BAUDS, LISTEN_S, PortReport, ask_url
from groundstation.declarations.errors import UsageError
from groundstation.parts.imu.sections import ImuOfVehicle
from groundstation.rig.read import load_rig

app = typer.Typer(add_completion=False, rich_markup_mode=None)


@app.command()
def devices(
    ports: Annotated[
        list[str] | None,
        typer.Argument(
            help="Ports to ask: /dev/ttyUSB0, a pty, socket://host:port. Default: every serial port."
        ),
    ] = None,
    baud: Annotated[list[int] | None, typer.Option(help="Bit rates to try; may be repeated.")] = None,
    listen_s: Annotated[float, typer.Option(help="Longest wait per port and bit rate, s.")] = LISTEN_S,
    rig: Annotated[
        Path | None, typer.Option(help="Rig file whose imu_serial_number says which mock-up a block is.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON list instead of a table.")] = False,
) -> None:
    """Ask every serial port who is there, and say which mock-up's IMU block it is.

    Example: groundstation devices --rig examples/rigs/two_mock_ups.toml
    """
    owners = _owners(rig)
    bauds = tuple(baud or BAUDS)
    if any(rate <= 0 for rate in bauds):
        raise UsageError(f"--baud is {min(bauds)}, expected a positive bit rate such as 250000")
    if not 0.05 <= listen_s <= 60:
        raise UsageError(f"--listen-s is {listen_s:g}, expected 0.05 to 60 seconds")
    urls = ports or sorted(port.device for port in list_ports.comports())
    if not urls:
        print(
            "[]"
            if as_json
            else "No serial ports on this machine; name one: groundstation devices socket://host:port"
        )
        return
    with ThreadPoolExecutor(max_workers=min(8, len(urls))) as pool:
        reports = list(pool.map(lambda url: ask_url(url, bauds=bauds, listen_s=listen_s), urls))
    problems = [report.problem for report in reports if report.problem]
    if ports and len(problems) == len(reports):
        raise UsageError("; ".join(problems))
    if as_json:
        print(json.dumps([_as_dict(report, owners) for report in reports], indent=1))
    else:
        _print_table(reports, owners)
    if ports and problems:
        raise typer.Exit(2)


def _owners(rig: Path | None) -> dict[int, str]:
    """Mock-ups by the serial number of their IMU block."""
    if rig is None:
        return {}
    loaded = load_rig(rig)
    numbers = {name: loaded.vehicle(name, ImuOfVehicle).imu_serial_number for name in loaded.vehicles}
    return {number: name for name, number in numbers.items() if number is not None}


def _owner(report: PortReport, owners: dict[int, str]) -> str | None:
    return None if report.identity is None else owners.get(report.identity.serial_number)


def _as_dict(report: PortReport, owners: dict[int, str]) -> dict[str, Any]:
    who = report.identity
    return {
        "mock_up": _owner(report, owners),
        "port": report.url,
        "baud": report.baud,
        "imu_block": report.is_imu_block,
        "frame_version": report.version,
        "serial_number": who.serial_number if who else None,
        "firmware": f"{who.firmware_major}.{who.firmware_minor}" if who else None,
        "sample_count": who.sample_count if who else None,
        "frames_heard": report.frames_received,
        "says": report.sentence,
        "counters": {name: count for name, count in report.counters.as_dict().items() if count},
    }


def _print_table(reports: list[PortReport], owners: dict[int, str]) -> None:
    table = Table("port", "baud", "mock-up", "who is there")
    for report in reports:
        table.add_row(report.url, str(report.baud), _owner(report, owners) or "-", report.sentence)
    Console().print(table)
