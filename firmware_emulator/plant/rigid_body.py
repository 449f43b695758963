"""One vehicle on the table: planar rigid-body truth in closed form between events.

Between two events (a valve moves, the floor jerks, a push ends, the air goes) thrust is one exponential and
everything else is nearly constant, so position, velocity, heading and rate have closed forms; the pieces
are at most 10 ms long. Neglected within a piece, with its size: the turn of the force against the table
beyond the middle heading (4e-6 of the force at 1 rad/s), the change of drag and of the slope.
"""

import math

from firmware_emulator.plant.air_table import FloorPulses, Surface
from firmware_emulator.plant.body import Body, DryFriction, Push
from firmware_emulator.plant.motion_state import Felt, Motion, PollGrid
from firmware_emulator.plant.thrusters import FAR_FUTURE_NS, NS_PER_S, ThrusterBank

_LONGEST_PIECE_NS = 10_000_000
_LONGEST_SLIDE_NS = 1_000_000  # dry friction turns with the velocity and ends abruptly
_SAME_SLOPE_M = 5e-4  # over which a wave of 0.8 m and 0.05 mrad changes the slope by 2 um/s^2


class Vehicle:
    """A vehicle that moves from event to event and remembers what its IMU felt at each poll.

    Args:
        body: Its constants.
        origin: Motion of the body's origin at `start_ns`.
        thrusters: Its valves.
        surface: Slope of the table.
        floor: Shocks of the floor.
        friction_landed: Coefficient of dry friction with the air off.
        is_floating: Whether the air is on at the start.
        polls: When its IMU polls.
        start_ns: Laboratory time of the start.
    """

    def __init__(
        self,
        body: Body,
        origin: Motion,
        thrusters: ThrusterBank,
        surface: Surface,
        floor: FloorPulses,
        friction_landed: float,
        is_floating: bool,
        polls: PollGrid,
        start_ns: int = 0,
    ) -> None:
        self.body = body
        self.thrusters = thrusters
        self.now_ns = start_ns
        self.is_floating = is_floating
        com_x, com_y = body.centre_of_mass_body_m
        self._origin_from_com_m = (-com_x, -com_y)
        self._imu_from_com_m = (body.imu_body_m[0] - com_x, body.imu_body_m[1] - com_y)
        self.motion = origin.of_point(body.centre_of_mass_body_m)
        self._surface, self._floor = surface, floor
        self._friction = DryFriction(friction_landed, body)
        self._polls = polls
        self._poll = polls.last_poll(start_ns)
        self._float_change_ns = FAR_FUTURE_NS
        self._float_wanted = is_floating
        self._pushes: list[Push] = []
        self._hand = (0.0, 0.0, 0.0)
        self._slope_at = (math.inf, math.inf)
        self._slope = (0.0, 0.0)
        self._felt: list[Felt] = []

    def set_air(self, now_ns: int, is_on: bool, delay_s: float) -> None:
        """Switch the bearings' air; they lift or set down after `delay_s`."""
        if is_on != self._float_wanted:
            self._float_wanted = is_on
            self._float_change_ns = now_ns + round(delay_s * NS_PER_S)

    def push(self, impulse_x_n_s: float, impulse_y_n_s: float, duration_ns: int) -> None:
        """Give the centre of mass an impulse (table frame) spread evenly over a duration from now."""
        force = NS_PER_S / duration_ns
        self._pushes.append(Push(impulse_x_n_s * force, impulse_y_n_s * force, self.now_ns + duration_ns))

    def set_hand(self, force_x_n: float, force_y_n: float, torque_nm: float) -> None:
        """Let a hand push from now on: force on the centre of mass (table frame) and torque; zeros end it.

        A landed vehicle does not yield.
        """
        self._hand = (force_x_n, force_y_n, torque_nm)

    def advance(self, until_ns: int) -> None:
        """Move on to `until_ns`, which is not before now."""
        while self.now_ns < until_ns:
            self._pass_events()
            end_ns = min(until_ns, self._next_event_ns(), self.now_ns + _LONGEST_PIECE_NS)
            if self.is_floating:
                self._glide((end_ns - self.now_ns) / NS_PER_S, end_ns)
            else:
                if self._is_sliding():
                    end_ns = min(end_ns, self.now_ns + _LONGEST_SLIDE_NS)
                self._stand((end_ns - self.now_ns) / NS_PER_S, end_ns)
            self.now_ns = end_ns
        self._pass_events()

    def origin_at(self, stamp_ns: int) -> Motion:
        """Motion of the body's origin at a moment not before now, as far as no event comes between.

        Advances only where one does: so looking does not change what the vehicle does by a bit less.
        """
        is_eventful = stamp_ns > self._next_event_ns() or (not self.is_floating and self._is_sliding())
        if is_eventful or stamp_ns > self.now_ns + _LONGEST_PIECE_NS:
            self.advance(stamp_ns)
        if stamp_ns == self.now_ns or not self.is_floating:
            return self.motion.of_point(self._origin_from_com_m)
        self._refresh_slope()
        return self._glided((stamp_ns - self.now_ns) / NS_PER_S)[0].of_point(self._origin_from_com_m)

    def take_felt(self) -> list[Felt]:
        """What the IMU felt at each poll since the last call, in order."""
        felt, self._felt = self._felt, []
        return felt

    def _next_event_ns(self) -> int:
        next_ns = min(self.thrusters.next_event_ns, self._float_change_ns)
        for push in self._pushes:
            next_ns = min(next_ns, push.end_ns)
        floor_ns = self._floor.next_change_ns(self.now_ns)
        return next_ns if floor_ns is None else min(next_ns, floor_ns)

    def _pass_events(self) -> None:
        self.thrusters.pass_events(self.now_ns)
        if self._float_change_ns <= self.now_ns:
            self.is_floating, self._float_change_ns = self._float_wanted, FAR_FUTURE_NS
        if self._pushes:
            self._pushes = [push for push in self._pushes if push.end_ns > self.now_ns]

    def _polls_until(self, end_ns: int) -> int:
        last = self._polls.last_poll(end_ns)
        count, self._poll = last - self._poll, last
        return count

    def _refresh_slope(self) -> None:
        x_m, y_m = self.motion.x_m, self.motion.y_m
        if abs(x_m - self._slope_at[0]) + abs(y_m - self._slope_at[1]) > _SAME_SLOPE_M:
            self._slope, self._slope_at = self._surface.slope_acceleration(x_m, y_m), (x_m, y_m)

    def _gliding_acceleration(self) -> tuple[float, float]:
        """Of an unpushed body at this place and moment: slope and floor, table frame."""
        jerk_x, jerk_y = self._floor.acceleration(self.now_ns)
        return self._slope[0] + jerk_x, self._slope[1] + jerk_y

    def _pushed_acceleration(self) -> tuple[float, float]:
        """By drag, hand and bumpers, table frame: what the IMU feels beside the thrust."""
        ax = self._hand[0] - self.body.drag_n_s_m * self.motion.vx_m_s
        ay = self._hand[1] - self.body.drag_n_s_m * self.motion.vy_m_s
        for push in self._pushes:
            ax += push.fx_n
            ay += push.fy_n
        return ax / self.body.mass_kg, ay / self.body.mass_kg

    def _glided(self, duration_s: float) -> tuple[Motion, float, float]:
        """Motion after gliding on for a while, and body-frame push acceleration (without thrust)."""
        now, body, bank = self.motion, self.body, self.thrusters
        turn_rad_s2 = -body.drag_nm_s * now.rate_rad_s / body.inertia_kg_m2
        push_x, push_y = self._pushed_acceleration()
        glide_x, glide_y = self._gliding_acceleration()
        heading = now.heading_rad + duration_s * (now.rate_rad_s + 0.5 * duration_s * turn_rad_s2)
        rate = now.rate_rad_s + turn_rad_s2 * duration_s
        dvx, dvy = (push_x + glide_x) * duration_s, (push_y + glide_y) * duration_s
        dx, dy = 0.5 * dvx * duration_s, 0.5 * dvy * duration_s
        if self._hand[2] != 0.0:
            rate += self._hand[2] / body.inertia_kg_m2 * duration_s
            heading += self._hand[2] / body.inertia_kg_m2 * 0.5 * duration_s * duration_s
        if not bank.is_quiet:
            rise_s = bank.timing.rise_s
            once_s = rise_s * -math.expm1(-duration_s / rise_s)  # integral of the decay
            twice_s2 = rise_s * (duration_s - once_s)
            half_s2 = 0.5 * duration_s * duration_s
            fx, fy, torque = bank.target
            gx, gy, gtorque = bank.wrench[0] - fx, bank.wrench[1] - fy, bank.wrench[2] - torque
            rate += (torque * duration_s + gtorque * once_s) / body.inertia_kg_m2
            middle = now.heading_rad + 0.5 * duration_s * now.rate_rad_s
            heading += (torque * half_s2 + gtorque * twice_s2) / body.inertia_kg_m2
            cosine, sine = math.cos(middle) / body.mass_kg, math.sin(middle) / body.mass_kg
            along, across = fx * duration_s + gx * once_s, fy * duration_s + gy * once_s
            dvx += cosine * along - sine * across
            dvy += sine * along + cosine * across
            along, across = fx * half_s2 + gx * twice_s2, fy * half_s2 + gy * twice_s2
            dx += cosine * along - sine * across
            dy += sine * along + cosine * across
        cosine, sine = math.cos(heading), math.sin(heading)
        return (
            Motion(
                now.x_m + now.vx_m_s * duration_s + dx,
                now.y_m + now.vy_m_s * duration_s + dy,
                heading,
                now.vx_m_s + dvx,
                now.vy_m_s + dvy,
                rate,
            ),
            cosine * push_x + sine * push_y,
            cosine * push_y - sine * push_x,
        )

    def _glide(self, duration_s: float, end_ns: int) -> None:
        self._refresh_slope()
        first_poll = self._poll
        count = self._polls_until(end_ns)
        after, push_x, push_y = self._glided(duration_s)
        if count:
            self._feel_gliding(first_poll, count, push_x, push_y)
        self.thrusters.relax(duration_s)
        self.motion = after

    def _feel_gliding(self, first_poll: int, count: int, push_x: float, push_y: float) -> None:
        bank, inertia = self.thrusters, self.body.inertia_kg_m2
        arm_x, arm_y = self._imu_from_com_m
        rate = self.motion.rate_rad_s
        if bank.is_quiet and self._hand[2] == 0.0:  # drag alone: alike within a piece
            turn = -self.body.drag_nm_s * rate / inertia
            force_x = push_x - turn * arm_y - rate * rate * arm_x
            force_y = push_y + turn * arm_x - rate * rate * arm_y
            self._felt += [(rate, force_x, force_y)] * count
            return
        first_s = (self._polls.stamp_ns(first_poll + 1) - self.now_ns) / NS_PER_S
        period_s = self._polls.period_ns / NS_PER_S
        fx, fy, torque = bank.target
        gx, gy, gtorque = bank.wrench[0] - fx, bank.wrench[1] - fy, bank.wrench[2] - torque
        rise_s, mass = bank.timing.rise_s, self.body.mass_kg
        turn_end, turn_excess = (torque + self._hand[2]) / inertia, gtorque / inertia
        end_x, end_y = push_x + fx / mass, push_y + fy / mass
        excess_x, excess_y = gx / mass, gy / mass
        for poll in range(count):  # a piece has ten or so, for which arrays cost more than their sums
            time_s = first_s + period_s * poll
            left = math.exp(-time_s / rise_s)
            turn = turn_end + turn_excess * left
            rate_then = rate + turn_end * time_s + turn_excess * rise_s * (1.0 - left)
            square = rate_then * rate_then
            force_x = end_x + excess_x * left - arm_y * turn - arm_x * square
            force_y = end_y + excess_y * left + arm_x * turn - arm_y * square
            self._felt.append((rate_then, force_x, force_y))

    def _is_sliding(self) -> bool:
        return self.motion.vx_m_s != 0.0 or self.motion.vy_m_s != 0.0 or self.motion.rate_rad_s != 0.0

    def _stand(self, duration_s: float, end_ns: int) -> None:
        """Landed: dry friction holds it, or stops it if it still slides. The valves cannot move it."""
        now = self.motion
        ax = ay = 0.0
        if self._is_sliding():
            self.motion, (ax, ay) = self._friction.slide(now, duration_s)
        self._refresh_slope()
        glide_x, glide_y = self._gliding_acceleration()
        count = self._polls_until(end_ns)
        if count:
            cosine, sine = math.cos(now.heading_rad), math.sin(now.heading_rad)
            felt_x, felt_y = ax - glide_x, ay - glide_y
            arm_x, arm_y = self._imu_from_com_m
            square = now.rate_rad_s * now.rate_rad_s
            force_x = cosine * felt_x + sine * felt_y - square * arm_x
            force_y = cosine * felt_y - sine * felt_x - square * arm_y
            self._felt += [(now.rate_rad_s, force_x, force_y)] * count
        self.thrusters.relax(duration_s)
