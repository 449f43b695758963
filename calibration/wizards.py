"""Guided calibrations of a running vehicle led on a terminal, as a node of its own beside the run."""

from __future__ import annotations

import hashlib
from datetime import UTC, datetime
from pathlib import Path

import zenoh

from calibration.delivery import deliver_guided
from groundstation.bus.zenoh_bus import HubError
from groundstation.declarations.errors import GroundStationError, UsageError
from groundstation.declarations.guide import Advice
from groundstation.launch.asking import user_name
from groundstation.launch.beside import run_beside
from groundstation.launch.guided import GuideNode, load_wizard
from groundstation.launch.running import find_running
from groundstation.rig.read import load_rig


def lead(name: str, rig_path: Path, vehicle: str | None, out: Path, *, is_driven: bool) -> None:
    """Lead an operator through a guided calibration of a run that is going on, and write its result.

    Args:
        name: Of the wizard.
        rig_path: Rig file of the run.
        vehicle: The rig's first if None.
        out: TOML to write.
        is_driven: Whether the requests are made here, too.

    Raises:
        UsageError: There is no such wizard, vehicle or run, or the rig lacks what it needs.
        GroundStationError: The run went away, or its data do not give the calibration.
    """
    wizard, rig = load_wizard(name), load_rig(rig_path)
    chosen = vehicle or next(iter(rig.vehicles))
    if chosen not in rig.vehicles:
        raise UsageError(f"{rig_path} has no vehicle {chosen!r} (it has {', '.join(rig.vehicles)}).")
    missing = wizard.missing(rig, chosen)
    if missing:
        raise UsageError(f"{rig_path}: {chosen} cannot be calibrated so: {missing}.")
    run = next((found for found in find_running() if chosen in found.vehicles), None)
    if run is None:
        raise UsageError(
            f"no run with a vehicle {chosen!r} is going on: start it with `groundstation run {rig_path}`."
        )
    guide = wizard.begin(rig, chosen)
    node = GuideNode(chosen, guide, _print_advice, user_name() if is_driven else "")
    try:
        run_beside(rig, run.endpoint, "guided_calibration", node, lambda: node.is_done)
    except (zenoh.ZError, HubError) as error:
        raise GroundStationError(f"the run at {run.endpoint} does not let us in: {error}") from error
    if node.trouble:
        raise GroundStationError(node.trouble)
    try:
        found = guide.outcome()
    except ValueError as error:
        raise GroundStationError(f"{chosen}: {error}.") from error
    digest = hashlib.sha256(rig_path.read_bytes()).hexdigest()
    deliver_guided(found, out, f"live, rig {rig_path.name}", digest, datetime.now(UTC))


def _print_advice(advice: Advice) -> None:
    if advice.ended:
        print(f"  {advice.ended}", flush=True)
    if advice.step is None:
        print("That was the last step.", flush=True)
    elif advice.is_new:
        print(f"{advice.step.name}: {advice.step.instruction}", flush=True)
    else:
        print(f"  {100 * advice.done:3.0f} %   {advice.missing}", flush=True)
    if advice.note:
        print(f"         {advice.note}", flush=True)
