"""``groundstation recording export``: a recorded flight as files that every command on files reads."""

from pathlib import Path
from typing import Annotated

import typer

from groundstation.data_sets.fusion_writing import folder_files
from groundstation.declarations.errors import UsageError
from groundstation.files.writing import whole_folder
from groundstation.recording.errors import RecordingError
from groundstation.watch.recorded_flight import known_of_rig, one_of, opened, recorded_flight


def export(
    file: Annotated[Path, typer.Argument(help="Recording (.mcap).")],
    fusion_folder: Annotated[Path, typer.Option(help="Folder for imu.csv, stars.csv, meta.json, truth.csv.")],
    vehicle: Annotated[str | None, typer.Option(help="Of a recording with several vehicles.")] = None,
) -> None:
    """Write a flight as a data set, so that it can be estimated again by every method.

    truth.csv is written where the recording holds poses of a reference system, for judging results only.

    Example: groundstation recording export run.mcap --fusion-folder try/again

    Example: groundstation fusion run try/again --out estimate.csv --method reintegration
    """
    try:
        with opened(file) as (recording, rig):
            chosen = one_of(file, tuple(rig.vehicles), vehicle, "there are")
            data = recorded_flight(file, recording, rig, chosen).tidied()
            more, name = known_of_rig(rig, chosen), f"{chosen} of {file.name}"
    except RecordingError as error:
        raise UsageError(str(error)) from error
    with whole_folder(fusion_folder) as folder:
        for written, text in folder_files(data, more, name).items():
            (folder / written).write_text(text, encoding="utf-8")
    print(f"{fusion_folder}: {len(data.imu)} packets, {len(data.stars)} fixes, {data.imu[-1, 0]:.1f} s")
    for note in data.notes:
        print(f"  {note}")
