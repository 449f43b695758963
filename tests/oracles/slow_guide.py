"""A guided calibration that a test can follow: the mean of what arrives, judged by what arrives later."""

from collections.abc import Iterator, Sequence

import numpy as np

from calibration.outcome import CalibrationRefusedError, Outcome
from calibration.result import Quantity
from groundstation.declarations.guide import Advice, Curve, Drawing, Step, Wish
from groundstation.declarations.message import Message
from groundstation.declarations.rig import Rig
from groundstation.parts.fusion.messages import VehicleState

COLLECT = Step("collect", "Let it stand.", True, (), 60.0)
CHECK = Step("check", "Let it stand on.", True, (), 60.0)


class MeanGuide:
    """The mean of x over ``enough`` states, tried on as many more."""

    kinds: tuple[type[Message], ...] = (VehicleState,)

    def __init__(self, enough: int) -> None:
        self._enough = enough
        self.taken: list[float] = []
        self.answers: list[tuple[str, str]] = []
        self._asked = False
        self._before: Step | None = None

    def take(self, message: Message, now_ns: int) -> None:
        del now_ns
        assert isinstance(message, VehicleState)
        self.taken.append(message.position_table_m[0])

    def advice(self, now_s: float) -> Advice:
        del now_s
        count = len(self.taken)
        step = COLLECT if count < self._enough else CHECK if count < 2 * self._enough else None
        before, self._before = self._before, step
        ended = f"{before.name}: enough data" if before is not None and before is not step else ""
        return Advice(step, min(1.0, count % self._enough / self._enough), "more", before is not step, ended)

    def pictures(self) -> Sequence[Drawing]:
        numbers = list(range(len(self.taken)))
        return (Drawing("What came", "number", "x, m", (Curve("x", numbers, list(self.taken)),)),)

    def hindrance(self) -> str:
        return "" if self.taken else "nothing is known of it yet."

    def requests(self, now_s: float) -> Iterator[Wish]:
        del now_s
        if not self._asked:
            self._asked = True
            yield "land", {}

    def answer(self, action: str, reason: str) -> None:
        self.answers.append((action, reason))

    def trouble(self) -> str:
        return ""

    def outcome(self) -> Outcome:
        fitted, aside = np.array(self.taken[: self._enough]), np.array(self.taken[self._enough :])
        if float(np.ptp(fitted)) > 1.0:
            raise CalibrationRefusedError("it moved")
        mean = float(fitted.mean())
        return Outcome(
            title="Mean",
            summary=f"mean {mean:.3f} m",
            quantities={"mean": Quantity(mean, float("nan"), "m")},
            residual={},
            notes={},
            verification={"off": Quantity(float(abs(aside - mean).mean()), float("nan"), "m")},
            verified_by=f"{len(aside)} states more",
            drawings=self.pictures(),
            also={".csv": "x_m\n"},
        )


class MeanWizard:
    """Makes them."""

    summary = "Mean: of where it stands."

    def __init__(self, enough: int = 10) -> None:
        self.enough = enough
        self.guides: list[MeanGuide] = []

    def missing(self, rig: Rig, vehicle: str) -> str:
        del rig
        return "" if vehicle == "alpha" else "only alpha stands"

    def begin(self, rig: Rig, vehicle: str) -> MeanGuide:
        del rig, vehicle
        self.guides.append(MeanGuide(self.enough))
        return self.guides[-1]
