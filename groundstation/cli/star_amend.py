"""``groundstation star-tracker amend``: the star list brought up to date from a recording."""

import csv
import hashlib
import io
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from calibration.result import CalibrationResult, Provenance
from calibration.sky.amendment import Amendment, AmendmentError, NewPlace, propose
from groundstation.bus.topics import topic_of
from groundstation.cli.errors import UsageError
from groundstation.cli.star_files import check_targets, write_atomically
from groundstation.files.errors import FileError
from groundstation.messages import definitions as m
from groundstation.nodes.star_answers import change_of
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recording
from groundstation.star_tracking.sky_change import SkyChange
from groundstation.star_tracking.star_catalogue import MIN_STARS, StarCatalogue

COLUMNS = ("id", "x_m", "y_m", "std_x_m", "std_y_m", "times_seen")


def amend(
    ceiling: Annotated[Path, typer.Argument(help="Star list that the recording was made with (CSV).")],
    recording: Annotated[Path, typer.Argument(help="Recording (.mcap).")],
    out: Annotated[Path, typer.Option(help="Star list to write (CSV); its provenance beside it (TOML).")],
    min_sightings: Annotated[
        int, typer.Option(help="Add lights that were seen so often at one place.", min=1)
    ] = 50,
) -> None:
    """Bring a star list up to date from a flight.

    Dead stars are struck off, moved ones put to their new places, new lights added.
    What the watchdog of the sky found while flying is applied; the last word on each star counts.

    Example:
      groundstation star-tracker amend ceiling.csv run.mcap --out ceiling_new.csv
    """
    beside = out.with_suffix(".toml")
    check_targets(out, beside)
    try:
        names = StarCatalogue.load(ceiling).ids
    except FileError as error:
        raise UsageError(str(error)) from error
    text = ceiling.read_text(encoding="utf-8")
    found, catalogues = _findings(recording)
    if catalogues and not any(text_then.rstrip().endswith(text.strip()) for text_then in catalogues):
        raise UsageError(f"{recording}: was recorded with another star list than {ceiling}: amend that one.")
    try:
        amendment = propose(names, found, min_sightings)
    except AmendmentError as error:
        raise UsageError(f"{ceiling}: {error}: amend the list that the recording was made with.") from error
    left = len(names) - len(amendment.struck) + len(amendment.added)
    if left < MIN_STARS:
        raise UsageError(f"{recording}: leaves {left} stars of {ceiling}, {MIN_STARS} are needed.")
    amended = _amended(text, amendment)
    provenance = _provenance(ceiling, recording, amendment)
    write_atomically(out, amended)
    write_atomically(beside, provenance)
    for name in amendment.struck:
        print(f"star {name}: struck off")
    for what, places in (("moved", amendment.moved), ("added", amendment.added)):
        for star in places:
            sigma = f"one sigma {1e3 * star.std_x_m:.2f}, {1e3 * star.std_y_m:.2f} mm"
            place = f"({star.x_m:.4f}, {star.y_m:.4f}) m"
            print(f"star {star.name}: {what}, {place}, {sigma}, seen {star.times_seen} times")
    print(f"{out}: {left} stars, {len(names)} before.")


def _findings(path: Path) -> tuple[list[tuple[str, SkyChange]], list[str]]:
    """What was found by whom, and the calibration texts that were in use."""
    found, texts = [], []
    try:
        with Recording(path) as recording:
            for message in recording.messages({topic_of(m.SkyChange), topic_of(m.CalibrationInUse)}):
                payload = message.payload
                if isinstance(payload, m.SkyChange):
                    found.append((payload.vehicle, change_of(payload)))
                elif isinstance(payload, m.CalibrationInUse):
                    texts.append(payload.content)
    except RecordingError as error:
        raise UsageError(str(error)) from error
    return found, texts


def _amended(text: str, amendment: Amendment) -> str:
    """The star list's text with the amendment applied, in the order of the list, new stars last."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    moved = {star.name: star for star in amendment.moved}
    for row in csv.DictReader(io.StringIO(text), skipinitialspace=True):
        fields = {key.strip(): value.strip() for key, value in row.items()}
        name = fields["id"]
        if name not in amendment.struck and name not in moved:
            std = (fields.get("std_x_m", "0"), fields.get("std_y_m", "0"))
            writer.writerow((name, fields["x_m"], fields["y_m"], *std, fields.get("times_seen", "0")))
        elif name in moved:
            writer.writerow(_row(moved[name]))
    for star in amendment.added:
        writer.writerow(_row(star))
    return out.getvalue()


def _row(star: NewPlace) -> tuple[str, ...]:
    place = (f"{star.x_m:.6f}", f"{star.y_m:.6f}", f"{star.std_x_m:.2e}", f"{star.std_y_m:.2e}")
    return star.name, *place, str(star.times_seen)


def _provenance(ceiling: Path, recording: Path, amendment: Amendment) -> str:
    digest = hashlib.sha256(recording.read_bytes()).hexdigest()
    notes = {
        "amended": ceiling.name,
        "amended_sha256": hashlib.sha256(ceiling.read_bytes()).hexdigest(),
        "struck": amendment.struck,
        "moved": [star.name for star in amendment.moved],
        "added": [star.name for star in amendment.added],
    }
    provenance = Provenance(recording.name, digest, datetime.now(UTC))
    return CalibrationResult(
        "Star list amended by the watchdog of the sky", provenance, {}, {}, notes
    ).to_toml()
