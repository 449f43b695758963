"""``groundstation recording export``: a recording as CSV or Parquet, or as a data set of ``fusion``."""

from pathlib import Path
from typing import Annotated

import typer

from groundstation.cli.run_progress import RunProgress
from groundstation.data_sets.fusion_writing import folder_files
from groundstation.declarations.errors import UsageError
from groundstation.files.writing import check_folder, whole_folder
from groundstation.recording.errors import RecordingError
from groundstation.recording.opened import OpenedRecording
from groundstation.recording.table_files import check_parquet, write_csv, write_parquet, write_tables
from groundstation.watch.recorded_flight import known_of_rig, one_of, opened, recorded_flight


def export(
    file: Annotated[Path, typer.Argument(help="Recording (.mcap), or the folder of a run.")],
    csv: Annotated[Path | None, typer.Option("--csv", help="Folder for a CSV file per topic.")] = None,
    parquet: Annotated[
        Path | None, typer.Option("--parquet", help="Folder for a Parquet file per topic; needs pyarrow.")
    ] = None,
    topic: Annotated[
        list[str] | None,
        typer.Option(help="Topic to export, e.g. alpha/state; may be repeated. Default: all but pictures."),
    ] = None,
    fusion_folder: Annotated[
        Path | None, typer.Option(help="Folder for imu.csv, stars.csv, meta.json, truth.csv.")
    ] = None,
    vehicle: Annotated[
        str | None, typer.Option(help="For --fusion-folder, of a recording with several vehicles.")
    ] = None,
    rig: Annotated[
        Path | None, typer.Option(help="For --fusion-folder, in place of the rig that the recording holds.")
    ] = None,
) -> None:
    """Write the topics of a recording as tables, or a flight as a data set that can be estimated again.

    Names of columns carry units; stamp_s counts from the beginning of the recording, stamp_ns is the host's
    clock. truth.csv of a data set is written where the recording holds poses of a reference system, for
    judging results only.

    Example: groundstation recording export run.mcap --csv try/tables

    Example: groundstation recording export run.mcap --parquet try/t --topic alpha/state --topic alpha/imu

    Example: groundstation recording export run.mcap --fusion-folder try/again
    """
    if sum(target is not None for target in (csv, parquet, fusion_folder)) != 1:
        raise UsageError("give one of --csv, --parquet and --fusion-folder: where the export goes")
    if topic and fusion_folder is not None:
        raise UsageError("--topic goes with --csv or --parquet: a data set has its own topics")
    if vehicle is not None and fusion_folder is None:
        raise UsageError(
            "--vehicle goes with --fusion-folder; tables are chosen by --topic, e.g. alpha/state"
        )
    if rig is not None and fusion_folder is None:
        raise UsageError("--rig goes with --fusion-folder: tables are as they were recorded")
    try:
        if fusion_folder is not None:
            _export_flight(file, fusion_folder, vehicle, rig)
        elif csv is not None:
            _export_tables(file, csv, topic, "csv")
        elif parquet is not None:
            check_parquet()
            _export_tables(file, parquet, topic, "parquet")
    except RecordingError as error:
        raise UsageError(str(error)) from error


def _export_flight(file: Path, fusion_folder: Path, vehicle: str | None, rig_path: Path | None) -> None:
    with opened(file, rig_path) as (recording, rig):
        chosen = one_of(file, tuple(rig.vehicles), vehicle, "there are")
        data = recorded_flight(file, recording, rig, chosen).tidied()
        more, name = known_of_rig(rig, chosen), f"{chosen} of {file.name}"
    with whole_folder(fusion_folder) as folder:
        for written, text in folder_files(data, more, name).items():
            (folder / written).write_text(text, encoding="utf-8")
    print(f"{fusion_folder}: {len(data.imu)} packets, {len(data.stars)} fixes, {data.imu[-1, 0]:.1f} s")
    for note in data.notes:
        print(f"  {note}")


def _export_tables(file: Path, target: Path, topics: list[str] | None, ending: str) -> None:
    check_folder(target)
    write = write_csv if ending == "csv" else write_parquet
    with OpenedRecording(file) as recording:
        for sentence in recording.missing:
            print(sentence)
        chosen = [recording.check(name) for name in topics or recording.topics_without_pictures]
        target.parent.mkdir(parents=True, exist_ok=True)
        lines = []
        with whole_folder(target) as folder, RunProgress(1.0) as progress:
            for path, table, left_out in write_tables(recording, chosen, folder, write, ending, progress):
                but = f", without {', '.join(left_out)}: bytes have no place in CSV" if left_out else ""
                lines.append(f"{target / path.name}: {len(table)} rows, {len(table.columns)} fields{but}")
    print("\n".join(lines))
