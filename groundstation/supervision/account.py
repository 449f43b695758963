"""What became of one vehicle in a run: faults, closures, time without a state, who landed it. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass

from groundstation.supervision.modes import ALOFT, Mode

LONGEST_GAP_S = 0.2
"""States that follow each other faster leave no time without a state."""


@dataclass(slots=True)
class Episode:
    """A fault from its beginning to its end.

    Attributes:
        id: Row of the table of faults.
        since_s: When it was found.
        until_s: When it was gone; None where it lasted to the end.
        detail: What was found first.
        response: The strongest one that was reported last.
    """

    id: str
    since_s: float
    until_s: float | None
    detail: str
    response: str


class Account:
    """Keeps the account of one vehicle; times in s from any fixed moment.

    Attributes:
        episodes: Faults in the order in which they began.
        closures: How often an open gate before the valves closed.
        time_without_state_s: In the air without a state to fly on, gaps of ``LONGEST_GAP_S`` and more.
        brought_down: Why the station landed it in flight without a person's word; empty if it did not.
    """

    def __init__(self) -> None:
        self.episodes: list[Episode] = []
        self.closures = 0
        self.time_without_state_s = 0.0
        self.brought_down = ""
        self._going_on: dict[str, Episode] = {}
        self._is_open = False
        self._aloft_since_s: float | None = None
        self._state_s = float("-inf")

    def take_faults(
        self,
        t_s: float,
        ids: Sequence[str],
        details: Sequence[str],
        responses: Sequence[str],
        there: Sequence[bool],
    ) -> None:
        """Every fault that stands; one that is only latched is over."""
        now = {
            fault: (detail, response)
            for fault, detail, response, is_there in zip(ids, details, responses, there, strict=True)
            if is_there
        }
        for fault in tuple(self._going_on):
            if fault not in now:
                self._going_on.pop(fault).until_s = t_s
        for fault, (detail, response) in now.items():
            episode = self._going_on.get(fault)
            if episode is None:
                episode = self._going_on[fault] = Episode(fault, t_s, None, detail, response)
                self.episodes.append(episode)
            episode.response = response

    def take_ruling(self, t_s: float, mode: str, author: str, cause: str, *, is_stop_latched: bool) -> None:
        """What the supervisor rules."""
        if mode in ALOFT:
            if self._aloft_since_s is None:
                self._aloft_since_s = t_s
            return
        if self._aloft_since_s is None:
            return
        self._add_gap(t_s)
        self._aloft_since_s = None
        if mode in (Mode.LANDING, Mode.LOST) and not author and not is_stop_latched:
            self.brought_down = cause

    def take_state(self, t_s: float, status: str) -> None:
        """A state; only one with status ``flying`` can be flown on."""
        if status == "flying":
            self._add_gap(t_s)
            self._state_s = t_s

    def take_gate(self, *, is_open: bool) -> None:
        """The gate before the valves."""
        self.closures += self._is_open and not is_open
        self._is_open = is_open

    def _add_gap(self, t_s: float) -> None:
        if self._aloft_since_s is not None:
            gap_s = t_s - max(self._state_s, self._aloft_since_s)
            if gap_s >= LONGEST_GAP_S:
                self.time_without_state_s += gap_s
