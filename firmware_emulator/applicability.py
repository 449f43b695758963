"""Whether a failure finds in a scenario what it befalls."""

from typing import Any

from firmware_emulator.failure_kinds import FailureKind


def why_not(name: str, kind: FailureKind, vehicle: Any, laboratory: Any) -> str | None:  # noqa: ANN401 - sections are known at run time
    """Why a failure would change nothing, as a sentence's end; None if it finds what it befalls.

    Args:
        name: Of the kind.
        kind: Its row of the table.
        vehicle: Its table of the scenario, with the sections that the installed devices gave it.
        laboratory: The scenario, likewise.
    """
    source = getattr(getattr(vehicle, "camera", None), "source", "none")
    if kind.device == "camera" and source == "none":
        return "the mock-up has no camera (camera.source is 'none')"
    if kind.device == "sky" and source != "rendered":
        return f"it shows in rendered pictures only, and camera.source is {source!r}"
    if name == "other_imu" and vehicle.imu.frame_version == 1:
        return "a block with frame_version = 1 reports no serial number"
    # A device that all share, or that a package brings: there if its section is.
    if getattr(laboratory, kind.device, vehicle) is None or getattr(vehicle, kind.device, vehicle) is None:
        return f"the scenario has no section {kind.device!r}"
    return None
