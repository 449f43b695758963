"""What a recovered recording lacks: it is stated in the file, so that whoever reads it later knows.

It travels as one MCAP metadata record of its own; a recording without gaps has none.
"""

import json
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from groundstation.recording.errors import RecordingError

GAPS_NAME = "groundstation.gaps"
_KEY = "gaps"


class Gap(NamedTuple):
    """Damaged chunks that were left out, one after the other.

    Attributes:
        chunks: How many.
        after_ns: Log time of the last message before them; None if there is none.
        before_ns: Log time of the first message after them; None if there is none.
    """

    chunks: int
    after_ns: int | None
    before_ns: int | None

    def sentence(self, start_ns: int) -> str:
        """For people.

        Args:
            start_ns: Log time at which the recording begins.
        """
        what = "damaged chunk was" if self.chunks == 1 else "damaged chunks were"
        which = "it" if self.chunks == 1 else "them"
        after, before = (
            None if ns is None else _since(ns, start_ns) for ns in (self.after_ns, self.before_ns)
        )
        if after is None and before is None:
            where = "and nothing else was there"
        elif after is None:
            where = f"before {before}"
        elif before is None:
            where = f"after {after}"
        else:
            where = f"between {after} and {before}"
        return f"{self.chunks} {what} left out {where}: what was in {which} is missing"


def _since(ns: int, start_ns: int) -> str:
    span_s = (ns - start_ns) * 1e-9
    return f"{span_s:.3g} s" if span_s < 100.0 else f"{span_s:.1f} s"


def to_metadata(gaps: Iterable[Gap]) -> dict[str, str]:
    """Keys and texts of the metadata record."""
    return {_KEY: json.dumps([list(gap) for gap in gaps])}


def from_metadata(reported: Mapping[str, str]) -> tuple[Gap, ...]:
    """Read a metadata record back.

    Raises:
        RecordingError: It is none of ours.
    """
    try:
        return tuple(
            Gap(int(chunks), *(None if ns is None else int(ns) for ns in (after, before)))
            for chunks, after, before in json.loads(reported.get(_KEY, "[]"))
        )
    except (ValueError, TypeError) as error:
        raise RecordingError(f"metadata record {GAPS_NAME!r}: {error}") from error
