"""A program outside the station that flies the vehicle: its newest wrench, once per modulation period."""

from collections.abc import Iterator

from drivers.outside.protocol import WRENCH
from groundstation.control.mux import CommandMux
from groundstation.control.state import BodyWrench
from groundstation.declarations.message import Message
from groundstation.declarations.request import Ack
from groundstation.parts.outside.messages import OutsideWrench
from groundstation.parts.valves.messages import OutsideControl
from groundstation.supervision.modes import Law

PAUSE_NS = 1_000_000_000
"""A program that a person took the vehicle from is heard again after it has been silent for so long."""
ANSWER_NS = 1_000_000_000
"""Refusals of wrenches are answered once in so long."""


class OutsidePilot:
    """Takes the vehicle with the first wrench that counts, and keeps it until it is given back.

    It is given back by a person's ``resume``, when the lease goes to somebody else or to nobody, and when
    the valves are closed, as on landing. An expired lease or silence does not give it back: the vehicle
    brakes and waits, for nobody has decided anything.

    Args:
        vehicle: Its name.
        choice: Is given the wrenches.
        period_ns: Of the modulation.
    """

    def __init__(self, vehicle: str, choice: CommandMux[BodyWrench], period_ns: int) -> None:
        self._vehicle, self._choice, self._period_ns = vehicle, choice, period_ns
        self._lifetime_ns = choice.outside_lifetime_ns
        self._author = ""
        self._wrench: BodyWrench | None = None
        self._arrival_ns = self._due_ns = 0
        self._objection = ""
        self._sent_away, self._sent_away_ns = "", 0
        self._given_back = ""
        self._answered_ns = -ANSWER_NS
        self._published = ("", False)

    def take(self, message: OutsideWrench, objection: str, law: Law | None, now_ns: int) -> Iterator[Message]:
        """Take a wrench, or answer why it does not count.

        Args:
            message: The wrench.
            objection: Of the control lease; empty for none.
            law: What the supervisor rules.
            now_ns: The moment.
        """
        arrival_ns = min(now_ns, message.stamp_ns)  # it may have waited
        refusal = self._refusal(message.author, arrival_ns, objection, law, now_ns)
        if message.author == self._author:
            self._objection = refusal
        if refusal:
            if now_ns - self._answered_ns >= ANSWER_NS:
                self._answered_ns = now_ns
                yield self._answer(message, now_ns, refusal)
            return
        if message.author != self._author:
            self._author, self._due_ns = message.author, now_ns
            yield self._answer(message, now_ns, "")
        self._wrench = BodyWrench(message.force_body_n, message.torque_nm)
        self._arrival_ns = arrival_ns

    def offer(self, law: Law | None, now_ns: int) -> bool:
        """Hand the newest wrench on if a period begins; whether it did."""
        if law is not Law.CONTROLLER or self._wrench is None or now_ns < self._due_ns:
            return False
        if self._is_silent(now_ns):
            return False
        self._due_ns = max(self._due_ns + self._period_ns, now_ns + self._period_ns // 2)  # keep the grid
        self._choice.command_from_outside(self._wrench, self._arrival_ns)
        return True

    def follow_lease(self, holder: str) -> None:
        """The lease is another one: who does not hold it any more has lost the vehicle."""
        if self._author and holder != self._author:
            self._end(f"control went to {holder or 'nobody'}")

    def follow_law(self, law: Law | None, now_ns: int) -> None:
        """The supervisor rules otherwise: closed valves end it, and after braking it goes on at once."""
        if law is Law.CLOSED and self._author:
            self._end("the valves were closed")
        self._due_ns = now_ns
        self.offer(law, now_ns)

    def give_back(self, reason: str, now_ns: int) -> None:
        """The controller flies it again; who flew it until now is not heard before a pause."""
        if self._author:
            self._sent_away, self._sent_away_ns = self._author, now_ns
            self._end(reason)

    def report(self, now_ns: int) -> Iterator[OutsideControl]:
        """Who has the vehicle and whether he is silent, when that has changed."""
        state = self._author, bool(self._author) and self._is_silent(now_ns)
        if state == self._published:
            return
        self._published = state
        reason = self._given_back
        if self._author:
            age_ms = (now_ns - self._arrival_ns) // 1_000_000
            reason = (self._objection or f"no wrench for {age_ms} ms") if state[1] else ""
        yield OutsideControl(now_ns, self._vehicle, *state, reason)

    def _refusal(self, author: str, arrival_ns: int, objection: str, law: Law | None, now_ns: int) -> str:
        if objection:
            return objection
        if now_ns - arrival_ns > self._lifetime_ns:
            return f"it has waited for {(now_ns - arrival_ns) // 1_000_000} ms"
        if author == self._sent_away and arrival_ns - self._sent_away_ns < PAUSE_NS:
            self._sent_away_ns = arrival_ns
            return f"a person has taken the vehicle back: pause for {PAUSE_NS * 1e-9:g} s to command it again"
        if author != self._author and law is not Law.CONTROLLER:
            return "only a flying vehicle can be commanded"
        return ""

    def _end(self, reason: str) -> None:
        self._author, self._wrench, self._given_back = "", None, reason
        self._choice.give_back()

    def _is_silent(self, now_ns: int) -> bool:
        return now_ns - self._arrival_ns > self._lifetime_ns

    def _answer(self, message: OutsideWrench, now_ns: int, refusal: str) -> Ack:
        return Ack(now_ns, self._vehicle, message.wrench_id, message.author, WRENCH, not refusal, refusal)
