"""What happened, in the order in which it came: marks of the charts, lines of the list."""

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from groundstation.console.feed import Feed
from groundstation.declarations.request import Ack, Request
from groundstation.parts.fusion.messages import FixAccount, VehicleState
from groundstation.parts.laboratory.messages import InjectedFailure
from groundstation.parts.operation.messages import Diagnostics
from groundstation.parts.scenario.messages import Marker
from groundstation.parts.stars.messages import SkyChange, StarFix
from groundstation.parts.supervision.messages import Faults, StopPress, Supervision

KEPT = 2000
"""Of what screens that come later are told."""
Event = Mapping[str, Any]


class Events:
    """Makes events of messages.

    Args:
        feed: To listen to.
        most: So many are kept.

    Attributes:
        kept: The newest, numbered by ``number``.
        last: Number of the newest; 0 before the first.
    """

    def __init__(self, feed: Feed, most: int = KEPT) -> None:
        self._feed = feed
        self.kept: deque[Event] = deque(maxlen=most)
        self.last = 0
        self._faults: dict[str, dict[str, bool]] = {}
        self._modes: dict[str, str] = {}
        self._summaries: dict[tuple[str, str], str] = {}
        feed.on(FixAccount, self._fix)
        feed.on(Request, self._request)
        feed.on(Ack, self._ack)
        feed.on(Faults, self._fault)
        feed.on(Supervision, self._mode)
        feed.on(StopPress, self._press)
        feed.on(Marker, self._marker)
        feed.on(InjectedFailure, self._failure)
        feed.on(SkyChange, self._sky)
        feed.on(Diagnostics, self._diagnostics)

    def since(self, number: int) -> list[Event]:
        """Those after a number, as far as they are kept."""
        return [event for event in self.kept if event["number"] > number]

    def keep(self, is_wanted: Callable[[Event], bool]) -> None:
        """Forget all others."""
        wanted = [event for event in self.kept if is_wanted(event)]
        self.kept.clear()
        self.kept.extend(wanted)

    def note(self, text: str, stamp_ns: int) -> None:
        """One of the console's own."""
        self._add("note", "", stamp_ns, text=text)

    def _add(self, kind: str, vehicle: str, stamp_ns: int, **more: object) -> None:
        self.last += 1
        event = {"number": self.last, "kind": kind, "vehicle": vehicle, "t_s": stamp_ns * 1e-9, **more}
        self.kept.append(event)

    def _fix(self, account: FixAccount, owner: str) -> None:
        del owner
        self._add(
            "fix",
            account.vehicle,
            account.stamp_ns,
            source=account.source,
            used=account.used,
            reason=account.reason,
            innovation=account.innovation,
            sigma=self._sigma(account),
            nis=account.nis,
            age_s_then=account.age_s,
        )

    def _sigma(self, account: FixAccount) -> tuple[float, ...] | None:
        """Of an innovation: of the star fix and of the state together; None where they are not known."""
        fix, state = self._feed.get(StarFix, account.vehicle), self._feed.get(VehicleState, account.vehicle)
        if fix is None or state is None or fix.stamp_ns != account.stamp_ns:
            return None
        variances = (fix.covariance[0], fix.covariance[4], fix.covariance[8])
        return tuple(
            (variance + sigma**2) ** 0.5 for variance, sigma in zip(variances, state.pose_sigma, strict=True)
        )

    def _request(self, request: Request, owner: str) -> None:
        del owner
        self._add(
            "request",
            request.vehicle,
            request.stamp_ns,
            author=request.author,
            action=request.action,
            arguments=request.arguments,
        )

    def _ack(self, ack: Ack, owner: str) -> None:
        del owner
        if not ack.accepted:
            text = f"{ack.action} refused: {ack.reason}"
            self._add("refusal", ack.vehicle, ack.stamp_ns, author=ack.author, text=text)

    def _press(self, press: StopPress, owner: str) -> None:
        del owner
        whom = press.vehicle or "all"
        self._add("stop", press.vehicle, press.stamp_ns, text=f"{press.author} pressed STOP for {whom}")

    def _fault(self, faults: Faults, owner: str) -> None:
        del owner
        before = self._faults.get(faults.vehicle, {})
        now = {id_: not gone for id_, gone in zip(faults.ids, faults.gone_ns, strict=True)}
        for place, id_ in enumerate(faults.ids):
            if now[id_] and not before.get(id_, False):
                text = f"{faults.whats[place]} ({faults.details[place]}): {faults.responses[place]}"
                self._add("fault", faults.vehicle, round(faults.since_ns[place]), id=id_, text=text)
        for id_, was_there in before.items():
            if was_there and not now.get(id_, False):
                self._add("cleared", faults.vehicle, faults.stamp_ns, id=id_, text=f"{id_} is gone")
        self._faults[faults.vehicle] = now

    def _mode(self, ruling: Supervision, owner: str) -> None:
        del owner
        if self._modes.get(ruling.vehicle) != ruling.mode:
            self._modes[ruling.vehicle] = ruling.mode
            text = f"{ruling.mode}: {ruling.cause}" if ruling.cause else ruling.mode
            self._add("mode", ruling.vehicle, ruling.stamp_ns, mode=ruling.mode, text=text)

    def _marker(self, marker: Marker, owner: str) -> None:
        del owner
        self._add("marker", "", marker.stamp_ns, text=marker.text)

    def _failure(self, failure: InjectedFailure, owner: str) -> None:
        del owner
        what = "begins" if failure.is_active else "ends"
        text = f"the laboratory: {failure.failure} {what}" if failure.failure else failure.refusal
        self._add("failure", failure.vehicle, failure.stamp_ns, text=text, is_active=failure.is_active)

    def _sky(self, change: SkyChange, owner: str) -> None:
        del owner
        text = f"{change.star or 'a light'} {change.change} at ({change.x_m:.2f}, {change.y_m:.2f}) m"
        self._add("sky", change.vehicle, change.stamp_ns, text=text)

    def _diagnostics(self, report: Diagnostics, owner: str) -> None:
        key = (owner, report.node)
        before = self._summaries.get(key)
        if report.level and before != report.summary:
            self._add("health", report.vehicle, report.stamp_ns, text=f"{report.node}: {report.summary}")
        self._summaries[key] = report.summary if report.level else ""
