"""The laboratory's own channel: reports failures as they begin and end, and takes orders to inject more."""

import heapq
import math
from collections import deque
from collections.abc import Mapping

from drivers.laboratory import LABORATORY_CHANNEL, ChannelKind, FailureEvent, FailureRefused, InjectOrder
from firmware_emulator.applicability import why_not
from firmware_emulator.config import LaboratoryConfig
from firmware_emulator.device_kind import DeviceKind
from firmware_emulator.devices.pending import take_until
from firmware_emulator.failures import NS_PER_S, Failure, FailureKind, Failures, checked
from firmware_emulator.plant.thrusters import FAR_FUTURE_NS
from firmware_emulator.scenario import Site

LONGEST_S = 1e6
"""Eleven days: who orders a longer failure has slipped; one without an end is infinite."""


class FailureDesk:
    """Keeps the moments at which failures begin and end.

    It acts before the devices, so that a failure is there when they act at the moment of its beginning.

    Args:
        failures: Of each vehicle.
        kinds: Every kind of failure.
        config: The scenario, which a failure may lack something in.
        start_ns: Laboratory time that failures count from.
    """

    def __init__(
        self,
        failures: Mapping[str, Failures],
        kinds: Mapping[str, FailureKind],
        config: LaboratoryConfig,
        start_ns: int,
    ) -> None:
        self._config = config
        self._failures, self._kinds, self._start_ns = dict(failures), dict(kinds), start_ns
        self._edges: list[tuple[int, bool, int, str, Failure]] = []  # stamp, begins, count, vehicle, failure
        self._count = 0
        self._pending: deque[tuple[int, FailureEvent | FailureRefused]] = deque()
        for vehicle, known in self._failures.items():
            for failure in known.all():
                self._expect(vehicle, failure)

    @property
    def next_ns(self) -> int:
        """When the next failure begins or ends."""
        return self._edges[0][0] if self._edges else FAR_FUTURE_NS

    @property
    def next_output_ns(self) -> int:
        """When the next event reaches the host: at once."""
        return self._pending[0][0] if self._pending else self.next_ns

    def run(self, now_ns: int) -> None:
        """Report what begins or ends now, to the host and to the devices that wait for it."""
        while self._edges and self._edges[0][0] <= now_ns:
            stamp_ns, begins, _, vehicle, failure = heapq.heappop(self._edges)
            self._failures[vehicle].report(self._kinds[failure.kind].device, now_ns)
            event = FailureEvent(failure.kind, vehicle, failure.parameters, is_active=begins)
            self._pending.append((stamp_ns, event))

    def take(self, until_ns: int) -> list[tuple[int, FailureEvent | FailureRefused]]:
        """Events up to `until_ns`."""
        return take_until(self._pending, until_ns)

    def receive(self, stamp_ns: int, data: InjectOrder) -> None:
        """Let a failure begin at `stamp_ns`, or refuse with the reason."""
        try:
            if data.vehicle not in self._failures:
                known = ", ".join(self._failures)
                raise ValueError(f"there is no vehicle {data.vehicle!r}; there are {known}")
            parameters = checked(data.kind, data.parameters, self._kinds)
            (mock_up,) = [row for row in self._config.vehicles if row.name == data.vehicle]
            reason = why_not(data.kind, self._kinds[data.kind], mock_up, self._config)
            if reason:
                raise ValueError(f"failure {data.kind!r} of {data.vehicle!r} cannot happen: {reason}")
            if not (0.0 < data.for_s <= LONGEST_S or data.for_s == math.inf):
                raise ValueError(f"for_s must be positive and at most {LONGEST_S:g} s, got {data.for_s:g}")
        except ValueError as error:
            self._pending.append((stamp_ns, FailureRefused(str(error))))
            return
        begins_ns = stamp_ns - self._start_ns
        ends_ns = None if math.isinf(data.for_s) else begins_ns + max(1, round(data.for_s * NS_PER_S))
        failure = Failure(data.kind, begins_ns, ends_ns, parameters)
        self._failures[data.vehicle].add(failure)
        self._expect(data.vehicle, failure)

    def _expect(self, vehicle: str, failure: Failure) -> None:
        for edge_ns, begins in ((failure.start_ns, True), (failure.end_ns, False)):
            if edge_ns is not None:
                self._count += 1
                heapq.heappush(self._edges, (self._start_ns + edge_ns, begins, self._count, vehicle, failure))


def build(site: Site, config: LaboratoryConfig) -> FailureDesk:
    """The desk of a laboratory."""
    failures = {mock_up.name: mock_up.failures for mock_up in site.mock_ups}
    return FailureDesk(failures, site.failure_kinds, config, site.scenario.start_ns)


LABORATORY = DeviceKind(
    name=LABORATORY_CHANNEL,
    channel=ChannelKind.FAILURES,
    per_laboratory=build,
    accepts=InjectOrder,
    served_by="firmware_emulator.live.failure_server:FailureServed",
)
