"""A calibration's result delivered: files together or not at all, words to the terminal."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from calibration.outcome import CalibrationRefusedError, Outcome
from calibration.result import Provenance, quantity_lines
from groundstation.declarations.errors import UsageError
from groundstation.declarations.guide import Found
from groundstation.files.json_file import json_text
from groundstation.files.png import png_of
from groundstation.files.writing import Content, write_files


@contextmanager
def refusing(source: Path | str | None = None, aside: Sequence[str] = ()) -> Iterator[None]:
    """Turn a refused calibration into a usage error, which names its source if the refusal does not.

    Args:
        source: What was read.
        aside: What of it was set aside, a sentence each.
    """
    try:
        yield
    except CalibrationRefusedError as error:
        text = "; ".join([str(error), *aside])
        sentence = text if text.endswith("?") else f"{text}."
        raise UsageError(sentence if source is None else f"{source}: {sentence}") from error


def deliver(
    found: Outcome,
    provenance: Provenance,
    out: Path,
    plot: Path | None = None,
    camera_out: Path | None = None,
    also: Mapping[Path, Content] | None = None,
    aside: Sequence[str] = (),
) -> None:
    """Write a result with its provenance, the camera and the figure; print summary and warnings.

    Args:
        found: The result.
        provenance: What it was made from.
        out: TOML to write.
        plot: PNG to write, if wanted.
        camera_out: camera.json to write, if wanted.
        also: Further files by name.
        aside: What of the data was set aside, a sentence each.

    Raises:
        FileError: A file cannot be written; then none is.
    """
    if aside:
        found = replace(found, notes={**found.notes, "set_aside": list(aside)})
    contents: dict[Path, Content] = {**(also or {}), out: found.to_toml(provenance)}
    if camera_out is not None and found.camera is not None:
        contents[camera_out] = json_text(found.camera.to_mapping())
    if plot is not None and found.draw is not None:
        contents[plot] = png_of(found.draw())
    write_files(contents)
    for warning in (*aside, *found.warnings):
        sys.stderr.write(f"{provenance.recording}: {warning}.\n")
    print(found.summary)


def deliver_guided(found: Found, out: Path, source: str, sha256: str, made_utc: datetime) -> None:
    """Write the result of a guided calibration with what belongs to it; print summary and verification.

    Raises:
        FileError: A file cannot be written; then none is.
    """
    write_files(found.written(out, source, sha256, made_utc))
    for warning in found.warnings:
        sys.stderr.write(f"{source}: {warning}.\n")
    print(found.summary)
    if found.verification:
        print(f"Verified by {found.verified_by}:")
        print("\n".join(f"  {line}" for line in quantity_lines(found.verification)))
