"""What can be requested of a vehicle's valves."""

from groundstation.declarations.request import Action, Argument

LONGEST_PUSH_S = 10.0  # an operator who went away must not push for ever
MOST_PUSH = 1000.0  # N or N m; no valve gives as much

PUSH = Action(
    "push",
    "command_mux",
    f"push by hand, body axes, for at most {LONGEST_PUSH_S:g} s; the controller waits",
    (
        Argument("force_x_n", low=-MOST_PUSH, high=MOST_PUSH),
        Argument("force_y_n", low=-MOST_PUSH, high=MOST_PUSH),
        Argument("torque_nm", low=-MOST_PUSH, high=MOST_PUSH),
        Argument("span_s", low=0.0, high=LONGEST_PUSH_S),
    ),
)
