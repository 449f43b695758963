"""What can be requested of a vehicle's valves."""

from groundstation.declarations.request import Action, Argument

LONGEST_PUSH_S = 10.0  # an operator who went away must not push for ever

PUSH = Action(
    "push",
    "command_mux",
    f"push by hand, body axes, for at most {LONGEST_PUSH_S:g} s; the controller waits",
    (
        Argument("force_x_n"),
        Argument("force_y_n"),
        Argument("torque_nm"),
        Argument("span_s", low=0.0, high=LONGEST_PUSH_S),
    ),
)
