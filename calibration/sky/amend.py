"""A star list brought up to date from a recording: read, amended, put into words."""

from __future__ import annotations

import hashlib
from pathlib import Path

from calibration.outcome import CalibrationRefusedError, Outcome
from calibration.sky.amendment import Amendment, NewPlace, propose
from calibration.sky.star_list import COLUMNS, star_list_text, star_row
from groundstation.declarations.errors import UsageError
from groundstation.files.number_tables import Table, parse_table
from groundstation.files.reading import read_bytes, text_of
from groundstation.parts.operation.messages import CalibrationInUse
from groundstation.parts.stars import messages as stars
from groundstation.parts.stars.star_answers import change_of
from groundstation.recording.reader import Recording
from groundstation.star_tracking.sky_change import SkyChange
from groundstation.star_tracking.star_catalogue import MIN_STARS, StarCatalogue


def amended_list(ceiling: Path, recording: Path, min_sightings: int) -> tuple[str, Outcome]:
    """Apply to a star list what the watchdog of the sky found while flying.

    Args:
        ceiling: The list that the recording was made with.
        recording: The recording.
        min_sightings: Lights are added that were seen so often at one place.

    Returns:
        The text of the list, and what was changed.

    Raises:
        RecordingError: The recording cannot be read.
        FileError: The list cannot be.
        UsageError: The recording was made with another list.
        CalibrationRefusedError: The findings do not fit the list, or too few stars would be left.
    """
    data = read_bytes(ceiling)
    names = StarCatalogue.parse(data, ceiling).ids
    text = text_of(data, ceiling)
    found, catalogues = _findings(recording)
    if catalogues and not any(_ends_with(then, text) for then in catalogues):
        raise UsageError(f"{recording}: was recorded with another star list than {ceiling}: amend that one.")
    amendment = propose(names, found, min_sightings)
    left = len(names) - len(amendment.struck) + len(amendment.added)
    if left < MIN_STARS:
        raise CalibrationRefusedError(f"{recording} leaves {left} stars of it, {MIN_STARS} are needed")
    notes = {
        "amended": ceiling.name,
        "amended_sha256": hashlib.sha256(data).hexdigest(),
        "struck": amendment.struck,
        "moved": [star.name for star in amendment.moved],
        "added": [star.name for star in amendment.added],
    }
    words = [*_words(amendment), f"{left} stars, {len(names)} before."]
    table = parse_table(data, ceiling, (), COLUMNS, optional=COLUMNS[3:])
    title = "Star list amended by the watchdog of the sky"
    return _applied(table, amendment), Outcome(title, "\n".join(words), {}, {}, notes)


def _ends_with(text_then: str, text: str) -> bool:
    """Whether the text in use then is this one, whatever ends its lines."""
    return "\n".join(text_then.splitlines()).rstrip().endswith("\n".join(text.splitlines()).strip())


def _findings(path: Path) -> tuple[list[tuple[str, SkyChange]], list[str]]:
    """What was found by whom, and the calibration texts that were in use."""
    found, texts = [], []
    with Recording(path) as recording:
        for message in recording.messages([stars.SkyChange, CalibrationInUse]):
            payload = message.payload
            if isinstance(payload, stars.SkyChange):
                found.append((payload.vehicle, change_of(payload)))
            elif isinstance(payload, CalibrationInUse):
                texts.append(payload.content)
    return found, texts


def _applied(table: Table, amendment: Amendment) -> str:
    """Return the list with the amendment applied, in its order, new stars last."""
    moved = {star.name: star for star in amendment.moved}
    rows: list[tuple[str, ...]] = []
    for name, x_m, y_m, sigma_x_m, sigma_y_m, times_seen in zip(
        *(table.words[c] for c in COLUMNS), strict=True
    ):
        if name in moved:
            rows.append(_row(moved[name]))
        elif name not in amendment.struck:
            rows.append((name, x_m, y_m, sigma_x_m or "0", sigma_y_m or "0", times_seen or "0"))
    return star_list_text([*rows, *(_row(star) for star in amendment.added)])


def _row(star: NewPlace) -> tuple[str, ...]:
    return star_row(star.name, (star.x_m, star.y_m), (star.sigma_x_m, star.sigma_y_m), star.times_seen)


def _words(amendment: Amendment) -> list[str]:
    lines = [f"star {name}: struck off" for name in amendment.struck]
    for what, places in (("moved", amendment.moved), ("added", amendment.added)):
        for star in places:
            sigma = f"one sigma {1e3 * star.sigma_x_m:.2f}, {1e3 * star.sigma_y_m:.2f} mm"
            place = f"({star.x_m:.4f}, {star.y_m:.4f}) m"
            lines.append(f"star {star.name}: {what}, {place}, {sigma}, seen {star.times_seen} times")
    return lines
