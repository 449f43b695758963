"""Fly a scenario with a control law of your own, without touching a rig: a first notebook.

    python examples/own_controller.py

A spring and a damper on each axis push alpha to its goal; beta flies the controller of its rig. The spring
comes to rest short of the goal, where it balances the tilt of the table: the controller of the rig finds the
tilt and feeds it forward.
"""

import math
from pathlib import Path

from groundstation import scenario
from groundstation.control.state import ControlState, Goal, rotate
from groundstation.frames import wrap_angle

SCENARIO = Path(__file__).parent / "scenarios" / "go_to.toml"


def spring(state: ControlState, goal: Goal, dt_s: float) -> tuple[float, float, float]:
    """Force along body x and y (N) and torque (N m)."""
    del dt_s
    (x, y), (goal_x, goal_y) = state.position_table_m, goal.position_table_m
    speed_x, speed_y = state.velocity_table_m_s
    pull = (0.25 * (goal_x - x) - 3.0 * speed_x, 0.25 * (goal_y - y) - 3.0 * speed_y)
    turn_rad = wrap_angle(goal.heading_rad - state.heading_rad)
    return *rotate(pull, -state.heading_rad), 0.02 * turn_rad - 0.12 * state.rate_rad_s


def main() -> None:
    """Fly with masses that the controllers do not know, and compare."""
    plan = scenario.load(SCENARIO)
    for mass_kg in (10.0, 12.0):
        heavier = plan.vary({"laboratory.alpha.mass_kg": mass_kg})
        for name, laws in (("of the rig", {}), ("spring", {"alpha": spring})):
            flown = scenario.run(heavier, seed=1, laws=laws)
            t_s, x_m, *_ = flown.truth("alpha")
            farthest_m = float(x_m[t_s > 0.0].max())
            settled = flown["alpha.settling_s"]
            when = f"settles after {settled:.1f} s" if math.isfinite(settled) else "does not settle"
            print(
                f"{mass_kg:.0f} kg, controller {name}: {when}, gas {flown['alpha.gas_ns']:.1f} N s, "
                f"farthest x {farthest_m:.2f} m; {'passed' if flown.passed else flown.reason}"
            )


if __name__ == "__main__":
    main()
