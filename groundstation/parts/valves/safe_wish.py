"""How much of a wish a mock-up may have now: the safety filter, with all that stands around."""

from groundstation.control.braking import Braking
from groundstation.control.corridor import Docking, may_touch
from groundstation.control.edge import EdgeOutlook, braking_to_count_on, edge_outlook
from groundstation.control.safety_filter import TURN_RATE, Disc, SafetyFilter, body_force, table_acceleration
from groundstation.control.state import NO_WRENCH, BodyWrench, ControlState, Vector2, clamp
from groundstation.control.surroundings import Surroundings
from groundstation.control.vehicle import VehicleModel
from groundstation.supervision.clearance import Clearance, clearance


class SafeWish:
    """What is safe of a wish.

    Args:
        vehicle: Its name.
        braking: The brake law: it knows the newest state, and what the valves that work can make.
        safety: The filter.
        surroundings: Obstacles, and where the others are.
        model: Mass properties.
        dockings: Pairs that may touch, each inside its corridor.

    Attributes:
        surroundings: See above.
        own_sigma_m: Of the place of the state that `braking` has, x and y.
        limited_by: What the last wish was changed for, in words; empty where it was not.
    """

    def __init__(
        self,
        vehicle: str,
        braking: Braking,
        safety: SafetyFilter,
        surroundings: Surroundings,
        model: VehicleModel,
        dockings: tuple[Docking, ...] = (),
    ) -> None:
        self._vehicle, self._braking, self._safety = vehicle, braking, safety
        self.surroundings = surroundings
        self._model, self._dockings = model, dockings
        self.own_sigma_m: tuple[float, float]  # known with the first state
        self.limited_by = ""

    def filtered(self, wanted: BodyWrench, now_ns: int) -> BodyWrench:
        """The wrench nearest to a wish that is safe."""
        state, envelope = self._braking.state, self._braking.envelope
        if state is None:
            self.limited_by = "no state"
            return NO_WRENCH
        makeable = envelope.saturate(wanted)
        found = self._safety.filtered(
            table_acceleration(makeable, state.heading_rad, self._model.mass_kg),
            state,
            self._discs(now_ns),
            braking_to_count_on(self._model, envelope),
        )
        inertia = self._model.inertia_kg_m2
        torque = inertia * self._safety.turned(makeable.torque_nm / inertia, state.rate_rad_s)
        spins = () if torque == makeable.torque_nm else (TURN_RATE,)
        self.limited_by = ", ".join(found.limited_by + spins)
        if found.must_brake:
            return self._braking.wrench(now_ns) or NO_WRENCH
        if not found.limited_by:
            return BodyWrench(makeable.force_body_n, torque) if spins else wanted
        force = body_force(found.acceleration_table_m_s2, state.heading_rad, self._model.mass_kg)
        torque = clamp(torque, self._safety.config.torque_share * envelope.max_torque_nm)
        return envelope.saturate(BodyWrench(force, torque))

    def resting_place(self, position_table_m: Vector2, now_ns: int) -> Vector2:
        """Where a mock-up that has braked is to be held: there, or a little off what is too near."""
        return self._safety.resting_place(position_table_m, self._discs(now_ns))

    def outlook(self, state: ControlState, now_ns: int) -> tuple[EdgeOutlook, Clearance]:
        """Where full braking would end: before the edge, and before whom it meets first."""
        braking_m_s2 = braking_to_count_on(self._model, self._braking.envelope)
        reaction_s = self._safety.config.reaction_s
        edge = edge_outlook(state, self._safety.keep_in, braking_m_s2, reaction_s=reaction_s)
        nearest = clearance(
            state,
            self.surroundings.others(now_ns),
            max(braking_m_s2, 1e-6),
            reaction_s=reaction_s,
            radius_m=self.surroundings.radius_m,
        )
        return edge, nearest

    def _discs(self, now_ns: int) -> list[Disc]:
        own = self._braking.state
        exempt = frozenset[str]()
        if own is not None and self._dockings:
            states = {**self.surroundings.others(now_ns), self._vehicle: own}
            exempt = may_touch(self._vehicle, self._dockings, states)
        return self.surroundings.discs(self.own_sigma_m, now_ns, exempt)
