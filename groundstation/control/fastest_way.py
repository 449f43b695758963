"""The push that takes a mock-up to a place in least time, judged anew from where it is.

Bang-bang in the phase plane (M. Athans, P. L. Falb, Optimal Control, 1966, chapter 7): full acceleration up
to the curve v = sqrt(2 a s), along which it brakes. The curve is drawn for a share of what the valves and the
slope give, and followed by feedback that may take all of it, as in the proximate time-optimal servomechanism
(M. Workman, R. Kosut, G. Franklin, Adaptive proximate time-optimal control of continuous time systems, IEEE
Conf. Decision and Control, 1987): valves that are weaker than stated brake harder, not too late.
"""

import math

from groundstation.control.authority import Authority
from groundstation.control.state import Vector2

PUSH_SHARE = 0.97
"""Of the valves' force, for speeding up: valves differ, and the heading needs some."""
BRAKE_SHARE = 0.70
"""For the curve: what is left brings a mock-up back to it that comes too fast."""
FOLLOWING_PER_S = 3.0
"""Acceleration per error of speed; with 0.15 s from a state to its pulses there is no ringing below 5."""
SLOWEST_M_S = 1e-3
"""Of the curve, for its slope."""


def fastest_acceleration(
    way_m: Vector2, velocity_m_s: Vector2, along: Authority, fastest_m_s: float
) -> Vector2:
    """The acceleration to ask for now, with the pull of the table already in it.

    Args:
        way_m: To the goal, table frame.
        velocity_m_s: Relative to the goal.
        along: What the valves give along the way, and the pull of the table there.
        fastest_m_s: Largest speed.

    Returns:
        Acceleration in the table frame, (x, y), m/s^2; along the way within what the valves give.
    """
    distance_m = math.hypot(*way_m)
    if distance_m == 0.0:
        return 0.0, 0.0
    x, y = way_m[0] / distance_m, way_m[1] / distance_m
    braking = along.braking(BRAKE_SHARE)
    curve_m_s = math.sqrt(2.0 * braking * distance_m)
    wanted_m_s = min(curve_m_s, fastest_m_s)
    forwards_m_s = velocity_m_s[0] * x + velocity_m_s[1] * y
    sideways_m_s = -velocity_m_s[0] * y + velocity_m_s[1] * x
    # the curve falls by a v / v_curve each second; a speed that is held does not
    falls = braking * max(forwards_m_s, 0.0) / max(curve_m_s, SLOWEST_M_S) if wanted_m_s == curve_m_s else 0.0
    ahead = FOLLOWING_PER_S * (wanted_m_s - forwards_m_s) - falls
    ahead = min(max(ahead, -along.braking(1.0)), along.accelerating(PUSH_SHARE))
    aside = -FOLLOWING_PER_S * sideways_m_s
    return ahead * x - aside * y, ahead * y + aside * x
