"""Star tracker: light spots in, pose of the body or the reason for none out."""

from collections import OrderedDict
from collections.abc import Iterator

from drivers.star_camera.exposure import ExposureDelay
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, ArgumentError, Request, answer
from groundstation.declarations.rig_file import RigFile
from groundstation.fusion.state_memory import StateMemory
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.operation.messages import CalibrationInUse
from groundstation.parts.stars import star_answers
from groundstation.parts.stars.actions import PICTURE
from groundstation.parts.stars.messages import PictureTrouble, SkyChange, StarFix, StarMatches, StarSpots
from groundstation.parts.stars.picture_choice import PictureChoice
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import BodyMotion, NoFix, PictureFix, PosePrior
from groundstation.star_tracking.identifications import IDENTIFICATIONS, SkySettings
from groundstation.star_tracking.picture_notes import take_notes
from groundstation.star_tracking.prior_governor import PriorGovernor
from groundstation.star_tracking.sky_watch import SkyWatch
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker as OwnTracker

_STILL_M = 1e-3
"""While its rows are read the picture may move so far; beyond, its lights are no witnesses of places."""
_TROUBLES = 64
"""Pictures that are none of their moment, the newest ones; spots come a second or two after their picture."""
REPEATED = "the spots repeat: every light is bit for bit where it was in the picture before"
"""Why there is no fix: the camera, or what finds the spots, is frozen."""


class StarTracker(Node):
    """Finds the ceiling in every set of spots, and names stars that died, moved or appeared.

    It starts from a prior where the state is known, else lost in space. Stars that died or moved are
    dropped until they are back: that takes the default identification, whose fixes name their stars for
    certain. Of refused pictures, and when asked, it states which light is what.

    Args:
        vehicle: Its name.
        camera: Calibration file of the camera.
        ceiling: Star catalogue.
        delay: From the middle of the exposure to a picture's stamp.
        settings: Of the search, exposure and shutter included.
        identification: Its row in the table of identifications.

    Raises:
        FileError: A file is missing or wrong.
    """

    inputs = (PictureTrouble, StarSpots, VehicleState, Request)
    paced = (VehicleState,)
    outputs = (StarFix, SkyChange, StarMatches, CalibrationInUse, Ack)

    def __init__(
        self,
        vehicle: str,
        camera: RigFile,
        ceiling: RigFile,
        delay: ExposureDelay,
        settings: SkySettings,
        identification: str = "default",
    ) -> None:
        super().__init__(vehicle)
        self._files = (camera, ceiling)
        self._stars, self._lens = ceiling.value(StarCatalogue.parse), camera.value(CameraCalibration.parse)
        self._readout_s = settings.tracker.readout_s
        self._solver = IDENTIFICATIONS[identification](self._stars, self._lens, settings)
        self._tracker = self._solver if isinstance(self._solver, OwnTracker) else None
        self._watch = (
            None if self._tracker is None else SkyWatch(self._stars, self._lens, rays=self._tracker.rays)
        )
        self._governor = PriorGovernor()
        self._states: StateMemory[VehicleState] = StateMemory()
        self._choice = PictureChoice()
        self._delay = delay
        self._last: tuple[bytes, bytes] | None = None
        self._troubles: OrderedDict[int, str] = OrderedDict()  # of pictures, by their stamps

    def start(self, now_ns: int) -> Iterator[Message]:
        yield CalibrationInUse.of(now_ns, self.vehicle, self._files)

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case VehicleState():
                self._states.remember(message)
            case PictureTrouble():
                self._troubles[message.stamp_ns] = message.reason
                if len(self._troubles) > _TROUBLES:
                    self._troubles.popitem(last=False)
            case StarSpots() as spots if spots.stamp_ns in self._troubles:
                reason = self._troubles[spots.stamp_ns]
                yield star_answers.refusal_message(spots, reason, *self._exposure(spots))
            case StarSpots(reason="") as spots if self._repeats(spots):
                yield star_answers.refusal_message(spots, REPEATED, *self._exposure(spots))
            case StarSpots(reason="") as spots:
                yield from self._solve(spots)
            case StarSpots() as spots:
                yield star_answers.refusal_message(spots, spots.reason, *self._exposure(spots))
            case Request() if message.action == PICTURE.name:
                try:
                    PICTURE.read(message)
                except ArgumentError as error:
                    yield answer(message, now_ns, str(error))
                    return
                self._choice.ask()
                yield answer(message, now_ns)

    def _solve(self, spots: StarSpots) -> Iterator[Message]:
        exposure_ns, sigma_s = self._exposure(spots)
        state = self._states.at(exposure_ns)
        belief = motion = None
        if state is not None:
            belief = star_answers.belief_of(state, sigma_s)
            motion = star_answers.motion_of(state)
        lights = star_answers.spots_of(spots)
        answer = self._solver.solve(lights, self._governor.admit(belief), motion)
        self._governor.note(answer, belief)
        if isinstance(answer, NoFix):
            reason = f"{answer.reason.value}: {answer.detail}"
            yield star_answers.refusal_message(spots, reason, exposure_ns, sigma_s)
            yield from self._explain(spots, lights, answer, answer.reason.value, reason, belief)
            return
        yield star_answers.fix_message(spots, answer, exposure_ns, sigma_s)
        yield from self._explain(spots, lights, answer, "", "", belief)
        yield from self._witnessed(spots, lights, answer, motion, exposure_ns)

    def _witnessed(
        self,
        spots: StarSpots,
        lights: Spots,
        answer: PictureFix,
        motion: BodyMotion | None,
        exposure_ns: int,
    ) -> Iterator[SkyChange]:
        """What a fix tells of the sky."""
        if self._tracker is None or self._watch is None or not self._is_still(self._tracker, motion):
            return
        changes = self._watch.note(answer, lights)
        if changes:
            self._tracker.drop(self._watch.dropped)
        for found in changes:
            yield star_answers.change_message(spots, found, exposure_ns)

    def _repeats(self, spots: StarSpots) -> bool:
        """Whether the lights are bit for bit where they were in the set before: noise never does that."""
        last, self._last = self._last, (spots.u_px.tobytes(), spots.v_px.tobytes())
        return len(spots.u_px) > 0 and self._last == last

    def _exposure(self, spots: StarSpots) -> tuple[int, float]:
        """Middle of the exposure and its standard deviation: from the driver's stamp where there is one."""
        stamp_ns = spots.device_stamp_ns or spots.stamp_ns
        return self._delay.middle_ns(stamp_ns), self._delay.delay_sigma_s

    def _explain(
        self,
        spots: StarSpots,
        lights: Spots,
        answer: PictureFix | NoFix,
        kind: str,
        reason: str,
        belief: PosePrior | None,
    ) -> Iterator[StarMatches]:
        if self._choice.wants(spots.stamp_ns, kind):
            notes = take_notes(lights, answer, self._lens, self._stars, belief)
            yield star_answers.matches_message(spots, notes, reason)

    def _is_still(self, tracker: OwnTracker, motion: BodyMotion | None) -> bool:
        if self._readout_s == 0.0:
            return True
        if motion is None:
            return False
        speed_m_s = abs(complex(motion.vx_table_m_s, motion.vy_table_m_s))
        speed_m_s += 0.5 * tracker.rays.reach_m * abs(motion.rate_rad_s)
        return speed_m_s * self._readout_s < _STILL_M
