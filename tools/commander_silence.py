"""How long after a commander's last wrench the brake's first valve is open, in virtual time.

A mock-up is on its way when its controller falls silent at a drawn moment, as if it hung; judged from the
stamp of its last wrench to the first status of the valve node that reports a valve open which the brake
commanded.
"""

import json
import math
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from fault_campaign import RIG

from groundstation.bus.envelope import Delivered
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Request
from groundstation.parts.control.messages import Wrench
from groundstation.parts.control.part import controller_node
from groundstation.parts.valves.messages import ValveSelection, ValveStatus
from groundstation.rig.read import parse_rig
from groundstation.runners.make_runner import make_runner

SENT_S, EARLIEST_S, LATEST_S, WATCHED_S = 12.0, 15.0, 19.0, 1.5


class Hangs(Node):
    """A node that takes in everything and publishes nothing more from a moment on.

    Args:
        node: That hangs.
        from_s: When.
    """

    def __init__(self, node: Node, from_s: float) -> None:
        super().__init__(node.vehicle, node.tick_period_ns)
        self.inputs, self.outputs, self.trigger = node.inputs, node.outputs, node.trigger
        self._node, self._from_ns = node, round(from_s * 1e9)

    def sources(self, payload: type[Message]) -> tuple[str, ...]:
        return self._node.sources(payload)

    def takes_paced(self, payload: type[Message], source: str) -> bool:
        return self._node.takes_paced(payload, source)

    def receive(self, message: Message, now_ns: int) -> Iterable[Message]:
        return self._heard(self._node.receive(message, now_ns), now_ns)

    def tick(self, now_ns: int) -> Iterable[Message]:
        return self._heard(self._node.tick(now_ns), now_ns)

    def _heard(self, made: Iterable[Message], now_ns: int) -> tuple[Message, ...]:
        published = tuple(made)
        return published if now_ns < self._from_ns else ()


class Watch:
    """Sees when the last wrench came, and when the brake's first valve opened."""

    KINDS = (Wrench, ValveSelection, ValveStatus)

    def __init__(self) -> None:
        self.last_ns = self.braked_ns = 0
        self._brakes = False

    def __call__(self, delivered: Delivered, now_ns: int) -> None:
        """A message, in the order of publication."""
        message = delivered.payload
        if not isinstance(message, Message) or message.vehicle != "alpha":
            return
        match message:
            case Wrench():
                self.last_ns, self._brakes, self.braked_ns = now_ns, False, 0
            case ValveSelection():
                self._brakes |= message.source == "brake" and any(message.on_time_ms)
            case ValveStatus():
                if self._brakes and message.open_mask and not self.braked_ns:
                    self.braked_ns = now_ns


def silence(seed: int) -> float:
    """Seconds from the last wrench to the report of the brake's first open valve; infinite if none came."""
    rng = np.random.default_rng([seed, 17])
    tilt = rng.uniform(-5e-4, 5e-4, 2)
    text = RIG.replace("TILT_X", f"{tilt[0]:.2e}").replace("TILT_Y", f"{tilt[1]:.2e}")
    rig = parse_rig(text, Path("silence.toml"))
    hangs_s = float(rng.uniform(EARLIEST_S, LATEST_S))
    watch = Watch()
    runner = make_runner(
        rig,
        seed,
        [watch],
        requests=_way(rng),
        journaled=False,
        replaced={"alpha/controller": Hangs(controller_node(rig, "alpha"), hangs_s)},
    )
    try:
        runner.run(round((hangs_s + WATCHED_S) * 1e9))
    finally:
        runner.close()
    return 1e-9 * (watch.braked_ns - watch.last_ns) if watch.braked_ns else math.inf


def _way(rng: np.random.Generator) -> Iterator[Request]:
    goal = {"x_m": 0.1, "y_m": -0.9, "heading_rad": float(rng.uniform(-3.0, 3.0))}
    yield Request(round(SENT_S * 1e9), "alpha", 1, "silence", "go_to", json.dumps(goal))
