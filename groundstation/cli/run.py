"""``groundstation run``: fly the vehicles of a rig, or a scenario, live or in lockstep."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from groundstation.bridges.foxglove import PORT as FOXGLOVE_PORT
from groundstation.cli.console_option import (
    FIRST_PORT,
    HOST,
    Certificates,
    ConsoleHost,
    ConsolePort,
    NoConsole,
    attendants,
)
from groundstation.cli.live_view import run_live
from groundstation.cli.number_options import LAST_SEED
from groundstation.cli.run_beside import beside_of, check_ports
from groundstation.cli.run_files import check_recording, finish_folder, finished_files, kept_in
from groundstation.cli.run_progress import RunProgress
from groundstation.core.library import default_core
from groundstation.declarations.errors import GroundStationError, UsageError
from groundstation.files.writing import check_folder
from groundstation.launch.live_run import LiveRun
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.recording.disk_file import check_new_recording
from groundstation.rig.read import parse_rig, read_text
from groundstation.scenario.loading import made
from groundstation.scenario.scenario_file import WHAT, content_of, is_scenario

app = typer.Typer(rich_markup_mode=None)

LONGEST_S = 31_557_600.0  # a year: a typo beyond it
LANDED_BY_FAULT = 1
"""Exit code of a run in which a vehicle ended otherwise than it should."""


@app.command()
def run(
    file: Annotated[Path, typer.Argument(help="Rig or scenario file (TOML).")],
    duration: Annotated[
        float | None,
        typer.Option(help="End by itself after this many seconds.", min=0.1, max=LONGEST_S),
    ] = None,
    headless: Annotated[bool, typer.Option("--headless", help="Write lines instead of a view.")] = False,
    report: Annotated[Path | None, typer.Option(help="Folder for report.html and report.json.")] = None,
    record: Annotated[
        Path | None,
        typer.Option(help="Recording to write (.mcap). Default: a folder of this run in recordings/."),
    ] = None,
    lockstep: Annotated[
        bool,
        typer.Option(
            "--lockstep", help="Virtual time, as fast as the CPU allows; of a rig it needs --duration."
        ),
    ] = False,
    seed: Annotated[
        int | None,
        typer.Option(help="Of the emulated laboratory; of a rig, in lockstep.", min=0, max=LAST_SEED),
    ] = None,
    hardware: Annotated[
        Path | None, typer.Option(help="Fly a scenario on this rig; its twin flies it first.")
    ] = None,
    i_know: Annotated[
        str | None, typer.Option("--i-know", help="Fly although the dry run was refused: why.")
    ] = None,
    by_hand: Annotated[
        bool, typer.Option("--by-hand", help="t = 0 of a scenario waits for a person's start_scenario.")
    ] = False,
    compare: Annotated[Path | None, typer.Option(help="Recording that the report lays beside.")] = None,
    hub_port: Annotated[
        int,
        typer.Option(help="Where programs outside reach it, on loopback; 0: a free port.", min=0, max=65535),
    ] = 0,
    no_console: NoConsole = False,
    console_host: ConsoleHost = HOST,
    console_port: ConsolePort = FIRST_PORT,
    console_certificates: Certificates = None,
    foxglove: Annotated[
        bool, typer.Option("--foxglove", help="Serve live data to Foxglove and Lichtblick, on loopback.")
    ] = False,
    foxglove_port: Annotated[
        int, typer.Option(help="Where; 0: a free port.", min=0, max=65535)
    ] = FOXGLOVE_PORT,
    ros2: Annotated[
        str | None, typer.Option(help="Bridge to ROS 2 by the router there, e.g. tcp/127.0.0.1:7447.")
    ] = None,
    ros2_domain: Annotated[int, typer.Option(help="Domain of ROS 2.", min=0, max=232)] = 0,
    guests: Annotated[
        str | None,
        typer.Option(help="Let other hosts join the bus at this address, e.g. 0.0.0.0 or 192.168.1.20:7449."),
    ] = None,
    guests_certificates: Annotated[
        Path | None, typer.Option(help="Folder that `groundstation certificates` made.")
    ] = None,
) -> None:
    """Fly the vehicles of a rig until Ctrl-C, or for --duration seconds; or a scenario until it is over.

    On a terminal the space bar stops all vehicles, l lands them, q ends the run. A web console is started
    besides, and its address printed.

    Without --record the run has a folder: recording, rig, scenario, calibrations, versions, notes and
    report.json.

    Exit code 0; 1 where a fault landed a vehicle, or the recording could not be written to the end; 2 where
    the rig is wrong. What a person stops or lands is no fault. Of a scenario: 0 where all its limits held, 1
    where one failed or a vehicle ended otherwise than it should, 2 where the file is wrong, 3 for an error.

    Example: groundstation run examples/rigs/two_mock_ups.toml

    Example: groundstation run examples/scenarios/go_to.toml --lockstep --report report

    Example: groundstation run examples/rigs/drawn_fixes.toml --lockstep --duration 120 --report report

    Example: groundstation run examples/rigs/two_mock_ups.toml --foxglove
    """
    port = foxglove_port if foxglove else None
    bridges, joined = beside_of(port, ros2, ros2_domain, guests, guests_certificates, is_live=not lockstep)
    if compare is not None:
        if report is None:
            raise UsageError("--compare goes with --report: the recording is drawn beside the run")
        check_recording(compare)
    default_core()  # before any process starts: what it lacks, all of them would
    text = read_text(file, WHAT)
    content = content_of(text, file)
    if is_scenario(content):
        if duration is not None:
            raise UsageError("--duration goes with a rig: a scenario has its own")
        if hub_port:
            raise UsageError("--hub-port goes with a rig: nobody commands a scenario from outside")
        if joined is not None:
            raise UsageError("--guests goes with a rig: nobody commands a scenario from outside")
        from groundstation.cli.run_scenario import Asked, run_scenario

        scenario = made(content, file)
        beside = [] if lockstep else attendants(
            console_host,
            console_port,
            console_certificates,
            no_console=no_console,
            scenario=(json.dumps(content), file.resolve()),
        )  # fmt: skip
        asked = Asked(
            lockstep,
            headless,
            seed,
            record,
            report,
            compare,
            hardware,
            i_know,
            text,
            (*beside, *bridges),
            by_hand,
        )
        raise typer.Exit(run_scenario(scenario, asked))
    if hardware is not None or i_know is not None:
        raise UsageError("--hardware and --i-know go with a scenario: a rig file flies on what it names")
    if by_hand:
        raise UsageError("--by-hand goes with a scenario: a rig has no timeline to start")
    loaded = parse_rig(text, file)
    if record is not None:
        check_new_recording(record)
    if report is not None:
        check_folder(report)
    if lockstep:
        if hub_port:
            raise UsageError("--hub-port goes with real time: in virtual time nobody comes from outside")
        if duration is None:
            raise UsageError("--lockstep needs --duration: virtual time has no end of its own")
    elif seed is not None:
        raise UsageError("--seed goes with --lockstep; live, the rig's [laboratory] table holds the seed")
    else:
        check_ports(hub_port, joined, port)
    trouble, lines = "", []
    with kept_in(record, loaded, text, loaded.name or file.stem) as (recording, folder):
        firsts = [recording]
        try:
            if lockstep:
                assert duration is not None
                with RunProgress(duration) as update:
                    faults = run_lockstep(loaded, text, file, recording, duration, seed, update)
            else:
                beside = attendants(console_host, console_port, console_certificates, no_console=no_console)
                live = LiveRun(
                    loaded, text, file, recording,
                    hub_port=hub_port, attendants=(*beside, *bridges), guests=joined,
                )  # fmt: skip
                firsts = live.recordings
                run_live(live, duration, headless=headless or not sys.stdout.isatty())
                faults, trouble, lines = live.faults, live.recording_trouble, live.recorder_lines
        finally:
            finished, torn = finished_files(*firsts)
        for line in (*lines, *faults.lines()):
            print(line)
        folder = finish_folder(folder, finished)
    if trouble or (torn and not finished):
        raise GroundStationError(trouble or f"no recording was finished: {torn[0]} is what is left")
    if report is not None:
        if not finished:
            raise GroundStationError("there is no report: no recording was finished")
        from groundstation.cli.report import print_report  # matplotlib: half a second that a start has not

        print_report(finished[-1] if folder is None else folder.path, report, compare=compare)
    if faults.brought_down:
        raise typer.Exit(LANDED_BY_FAULT)
