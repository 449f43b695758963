"""THE TABLE of faults: how each is found and how soon, what is done about it, how it clears.

Failures are injected (``firmware_emulator/failures.py``), faults are detected here. A response degrades in
steps: what helps least is tried last and only when a fault lasts.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum, StrEnum


class Response(IntEnum):
    """What is done about a fault, weakest first: where faults disagree the strongest counts."""

    NOTE = 0
    HOLD = 1
    LAND = 2
    CUT = 3

    @property
    def words(self) -> str:
        """For people."""
        return _WORDS[self]


_WORDS = {
    Response.NOTE: "flies on",
    Response.HOLD: "brakes and holds",
    Response.LAND: "brakes, then lands",
    Response.CUT: "cuts the float air",
}


class Clears(StrEnum):
    """Who ends a fault."""

    ITSELF = "by itself"
    PERSON = "by a person"


@dataclass(frozen=True, slots=True)
class Fault:
    """A row of the table.

    Attributes:
        id: Of the fault.
        what: What is wrong, in a sentence.
        found_by: How it is detected.
        within_s: Time from its beginning to its event.
        steps: Pairs of (s since it was found, response), ascending.
        clears: By itself, once it has not been seen for ``CLEAR_S``; or by a person's release or fly.
        blocks_arming: It keeps a vehicle on the ground.
        may_be_overridden: A person may arm in spite of it, with a reason.
        advice: What a person can do.
        failures: What the emulator can do to provoke it; empty where tests kill processes instead.
        confirm_s: So long without a break it must be seen: what may be on its way is none.
    """

    id: str
    what: str
    found_by: str
    within_s: float
    steps: tuple[tuple[float, Response], ...]
    clears: Clears
    blocks_arming: bool
    may_be_overridden: bool
    advice: str
    failures: tuple[str, ...] = ()
    confirm_s: float = 0.0

    def response(self, age_s: float) -> Response:
        """What is due when it has lasted for a while."""
        due = self.steps[0][1]
        for after_s, response in self.steps:
            if age_s >= after_s:
                due = response
        return due


CLEAR_S = 1.0
"""So long a fault that clears by itself must not have been seen."""
LATEST_OUTAGE_S = 2.7
"""With 1.5 fixes a second that are 0.6 s late: three intervals after the last one came. With 15: 0.5 s."""
_NOTE, _HOLD, _LAND, _CUT = Response.NOTE, Response.HOLD, Response.LAND, Response.CUT
_ITSELF, _PERSON = Clears.ITSELF, Clears.PERSON

FAULTS: Mapping[str, Fault] = {
    row.id: row
    for row in (
        # -- where it is ----------------------------------------------------------------------------
        Fault("star_outage", "No fix places it: it flies on dead reckoning.",
              "no fix used for three of its usual intervals, 0.5 s at least", LATEST_OUTAGE_S,
              ((0.0, _NOTE), (20.0, _LAND)), _ITSELF, True, False,
              "Look at the lights and at the camera.", ("dead_sky", "silent_camera")),
        Fault("position_uncertain", "Dead reckoning has become too uncertain.",
              "a standard deviation of the position above 50 mm, or of the heading above 5 deg", 1.0,
              ((0.0, _LAND),), _ITSELF, True, False,
              "Bring the fixes back; see how long they have been missing."),
        Fault("fusion_lost", "Fusion does not know where it is.", "the status of its state", 0.5,
              ((0.0, _HOLD), (1.0, _CUT)), _ITSELF, True, False,
              "See which fixes were refused, and why."),
        Fault("state_silent", "No state comes: the flight process is dead, hangs, or has no IMU samples.",
              "no state for 0.3 s", 0.5,
              ((0.0, _HOLD), (0.5, _LAND), (1.5, _CUT)), _ITSELF, True, False,
              "See whether the process is started again and the IMU block sends.", ("silent_imu",)),
        Fault("camera_frozen", "The camera repeats a picture or a pose.",
              "pictures, spots or poses that are identical to earlier ones", 1.0,
              ((0.0, _LAND),), _ITSELF, True, False,
              "Restart the camera.", ("frozen_camera", "repeating_camera")),
        Fault("camera_torn", "Pictures are put together from two exposures.",
              "rows that came before, or stars of two moments in one picture", 1.0,
              ((0.0, _NOTE),), _ITSELF, True, True,
              "Look at the camera's cable and driver.", ("torn_camera",)),
        Fault("fixes_rare", "Fixes come much less often than they did.",
              "their number within a second", 2.0,
              ((0.0, _NOTE),), _ITSELF, False, False,
              "Look at the load of the machine and at the camera.", ("slow_camera",)),
        Fault("filter_inconsistent", "Fixes lean further than the filter expects.",
              "innovations of used fixes against their covariance", 3.0,
              ((0.0, _NOTE),), _ITSELF, False, False,
              "Make a map of the table; calibrate lens, sky and IMU."),
        Fault("wrong_fixes", "Fixes contradict the IMU and each other.",
              "a burst of refused fixes", 1.0,
              ((0.0, _NOTE), (3.0, _LAND)), _ITSELF, True, True,
              "Look for foreign lights; survey the ceiling again.", ("wrong_fixes", "false_lights")),
        # -- how it moves ---------------------------------------------------------------------------
        Fault("imu_silent", "Nothing comes from the IMU block.", "no sample for 0.3 s", 0.5,
              ((0.0, _HOLD), (0.5, _LAND), (1.5, _CUT)), _ITSELF, True, False,
              "Look at the block's cable and supply.", ("silent_imu", "lost_bytes")),
        Fault("accelerometer_lost", "An accelerometer is not believed; gyro, fixes and commands stand in.",
              "the reader's plausibility checks", 0.3,
              ((0.0, _NOTE),), _ITSELF, True, True, "Replace its chip.", ("dead_tilt",)),
        Fault("imu_stuck", "The gyro repeats one value.", "the reader's plausibility checks", 0.8,
              ((0.0, _LAND), (1.5, _CUT)), _PERSON, True, False,
              "Replace the block, or its chip.", ("stuck_gyro",)),
        Fault("imu_implausible", "Samples of the IMU cannot be true.", "the reader's plausibility checks",
              1.0, ((0.0, _LAND), (1.5, _CUT)), _ITSELF, True, False,
              "See the reason; calibrate the block.", confirm_s=0.5),
        Fault("imu_of_another_vehicle", "The IMU block has another serial number than the rig states.",
              "the number that frames carry", 1.0,
              ((0.0, _LAND), (1.0, _CUT)), _PERSON, True, False,
              "Connect the right block, or correct the rig.", ("other_imu",)),
        Fault("imu_shifted", "A zero offset of the IMU has stepped.",
              "fixes that contradict the IMU one-sidedly, or an offset beyond what it may be", 1.0,
              ((0.0, _LAND), (2.0, _CUT)), _PERSON, True, True,
              "Calibrate the block at rest again.", ("shifted_imu",)),
        Fault("imu_clock_jumped", "The tick counter of the IMU block has jumped.",
              "ticks against arrivals", 0.5,
              ((0.0, _NOTE),), _ITSELF, True, True, "Look for resets of the block.", ("clock_jump",)),
        Fault("pushed", "Something that is no valve pushed it: a hand, a hose, a neighbour.",
              "acceleration that no valve explains", 0.5,
              ((0.0, _NOTE),), _ITSELF, True, True, "See what touched it.", ("pushed",)),
        # -- what pushes it -------------------------------------------------------------------------
        Fault("valve_stuck_open", "A valve pushes that nobody opened.",
              "acceleration against the commands", 2.0,
              ((0.0, _LAND), (3.0, _CUT)), _PERSON, True, False, "Clean or replace the valve.",
              ("stuck_open_valve", "leaking_valve", "pulsing_valve")),
        Fault("valve_stuck_closed", "A valve does not push when it is opened.",
              "acceleration against the commands", 1.0,
              ((0.0, _NOTE),), _PERSON, True, False,
              "The others fly on; look at the coil, the hose and the valve.",
              ("stuck_closed_valve", "weak_valve")),
        Fault("thrust_missing", "The valves that work cannot make every wrench that flight needs.",
              "what valves were found to give", 0.5,
              ((0.0, _LAND),), _PERSON, True, False, "Repair the valves that were named."),
        Fault("valve_weak", "A valve pushes with less than it should.",
              "acceleration against the commands", 10.0,
              ((0.0, _NOTE),), _PERSON, True, True, "Look at pressure and nozzle.", ("weak_valve",)),
        Fault("coil_fault", "The node reports an open or shorted coil.", "fault bits of the valve node", 0.5,
              ((0.0, _LAND),), _PERSON, True, False, "Look at the coil's wires.", ("open_coil",)),
        Fault("tank_low", "The tank is nearly empty.", "tank pressure below 30 bar", 1.0,
              ((0.0, _LAND),), _ITSELF, True, True, "Fill the tank.", ("low_tank",)),
        Fault("battery_low", "The supply of the valve node is low.", "fault bits of the valve node", 1.0,
              ((0.0, _LAND),), _ITSELF, True, True, "Charge the battery.", ("low_battery",)),
        Fault("can_silent", "Nothing comes from the valve node.", "no status for 0.5 s", 0.7,
              ((0.0, _CUT),), _ITSELF, True, False,
              "Look at adapter, cable and supply; by itself the node cuts its air after 1 s.",
              ("silent_bus",)),
        Fault("can_flooded", "The CAN bus is flooded.", "more frames a second than the nodes send", 1.0,
              ((0.0, _LAND),), _ITSELF, True, False, "Find the babbling node.", ("flooded_bus",),
              confirm_s=0.4),
        Fault("node_disobeys", "The valve node is disarmed, or closed by its dead man, in flight.",
              "its status against what is commanded", 0.5,
              ((0.0, _NOTE), (0.5, _CUT)), _ITSELF, True, False, "See whether the node was reset.",
              confirm_s=0.2),
        # -- where it may go ------------------------------------------------------------------------
        Fault("edge_ahead", "It would not stop before the edge of the table.",
              "its stopping distance", 0.1,
              ((0.0, _HOLD),), _ITSELF, True, False, "Give it another goal."),
        Fault("edge_unavoidable", "Braking would end beyond the edge; disarmed, landing soon would.",
              "its stopping distance", 0.1,
              ((0.0, _CUT),), _PERSON, False, False, "Put it back on the table."),
        Fault("vehicle_ahead", "It would not stop before another vehicle.",
              "stopping distances of both", 0.1,
              ((0.0, _HOLD),), _ITSELF, True, False, "Give one of them another goal."),
        Fault("vehicle_unavoidable", "Braking would end at another vehicle; disarmed, landing soon would.",
              "stopping distances of both", 0.1,
              ((0.0, _CUT),), _PERSON, False, False, "Put them apart."),
        # -- who looks after it ---------------------------------------------------------------------
        Fault("controller_silent", "No demand comes from the controller.",
              "no demand for 0.5 s while there is a state", 1.0,
              ((0.0, _HOLD), (5.0, _LAND)), _ITSELF, True, False,
              "See whether the controller's process is started again."),
        Fault("outside_silent", "The program that flies it from outside is silent.",
              "no wrench of its that counts for 0.24 s", 0.5,
              ((0.0, _HOLD),), _ITSELF, False, False,
              "Start the program again; or resume: the controller then flies it."),
        Fault("detector_silent", "Nothing comes from the fault detector.", "no findings for 1 s", 1.5,
              ((0.0, _NOTE), (2.0, _LAND)), _ITSELF, True, False,
              "See whether the flight process is started again."),
        Fault("commands_restarted", "The command process was started again in flight.",
              "what was kept on disk", 1.0,
              ((0.0, _HOLD),), _ITSELF, False, False, "See why it ended."),
        Fault("clock_jumped", "The station's clock went back or stood still.",
              "moments that nodes are given", 0.5,
              ((0.0, _LAND),), _ITSELF, True, False, "Let the station neither sleep nor be paused."),
        Fault("cpu_starved", "The command process gets too little of the processor.",
              "ticks that come more than 100 ms late", 1.0,
              ((0.0, _NOTE),), _ITSELF, True, True, "End other programs on this machine."),
        Fault("memory_lost", "What must outlive a restart cannot be kept: a stop would be forgotten.",
              "writes of the memory that fail", 0.5,
              ((0.0, _NOTE),), _ITSELF, True, False,
              "Free space on the disk of XDG_STATE_HOME; see that its folder is there."),
        Fault("recorder_down", "Recording was asked for and nothing comes from the recorder.",
              "no status for 2 s", 3.0,
              ((0.0, _NOTE),), _ITSELF, True, True, "See the recorder's last words."),
        Fault("disk_low", "The disk of the recording will be full within a minute.",
              "room left against the rate of writing", 2.0,
              ((0.0, _NOTE),), _ITSELF, True, True, "Free space on the disk."),
        Fault("recording_lost", "What was recorded is lost, or nothing is recorded.",
              "what the recorder reports of its file and its disk", 1.5,
              ((0.0, _NOTE),), _ITSELF, True, True,
              "See that nobody deletes or unmounts what is being recorded."),
        Fault("leader_old", "What another vehicle of its formation publishes is old.",
              "no state or sighting of it for 1 s; the distance widens before, then the place is held", 1.5,
              ((0.0, _NOTE), (4.0, _HOLD)), _ITSELF, False, False,
              "See what is wrong with the other vehicle."),
    )
}  # fmt: skip
"""THE TABLE, by id."""
