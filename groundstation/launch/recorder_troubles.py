"""What is told of a recorder's troubles: why it stopped, and at the end of the run each once, with when."""

from collections.abc import Iterator

from groundstation.launch.child import Child
from groundstation.launch.process import TROUBLE

MOST_SHOWN = 20


def final_trouble(recorder: Child | None, began_s: float) -> str:
    """Why the recording was not written to its end; known once all has ended, empty where it was.

    Args:
        recorder: Its process.
        began_s: When the run began, on the monotonic clock.
    """
    words = _final_words(recorder)
    if recorder is None or not words:
        return ""
    at_s = next((at_s for at_s, said in recorder.history if said == words), began_s)
    return f"{words} (After {at_s - began_s:.1f} s.)"


def why_stopped(recorder: Child | None) -> str:
    """Why no recorder runs until it is started again; empty where one does, or starts for the first time."""
    is_stopped = recorder is not None and recorder.restart_at_s is not None
    return recorder.history[-1][1] if recorder is not None and is_stopped else ""


def _final_words(recorder: Child | None) -> str:
    return recorder.last_words if recorder is not None and recorder.code == TROUBLE else ""


def closing_lines(recorder: Child | None, began_s: float) -> Iterator[str]:
    """For people; nothing where nothing went wrong. What ``final_trouble`` says is left to who raises it.

    Args:
        recorder: Its process.
        began_s: When the run began, on the monotonic clock.
    """
    if recorder is None:
        return
    history, last = list(recorder.history), _final_words(recorder)
    first_s: dict[str, float] = {}
    counts: dict[str, int] = {}
    for at_s, words in history:
        first_s.setdefault(words, at_s)
        counts[words] = counts.get(words, 0) + 1
    rows = [words for words in first_s if words != last]
    for words in rows[:MOST_SHOWN]:
        times = f" ({counts[words]} times)" if counts[words] > 1 else ""
        yield f"recorder, after {first_s[words] - began_s:.1f} s: {words}{times}"
    if len(rows) > MOST_SHOWN:
        yield f"recorder: and {len(rows) - MOST_SHOWN} more"
