"""What can be requested of a vehicle's valves."""

from groundstation.declarations.request import Action, Argument, table_of

LONGEST_PUSH_S = 10.0  # an operator who went away must not push for ever

GUARD = table_of(
    Action("arm", "guard", "let valves open"),
    Action("disarm", "guard", "close all valves and keep them closed"),
    Action("stop", "guard", "close all valves at once and latch it"),
    Action("release", "guard", "end a latched stop; the vehicle stays disarmed"),
)
MULTIPLEXER = table_of(
    Action("brake", "command_mux", "take the speed away and hold still, whatever the controller says"),
    Action("resume", "command_mux", "end braking or pushing"),
    Action(
        "push",
        "command_mux",
        f"push by hand, body axes, for at most {LONGEST_PUSH_S:g} s; the controller waits",
        (
            Argument("force_x_n"),
            Argument("force_y_n"),
            Argument("torque_nm"),
            Argument("span_s", low=0.0, high=LONGEST_PUSH_S),
        ),
    ),
)
FLOAT_AIR = table_of(
    Action("float_on", "valve_writer", "switch the float air on"),
    Action("float_off", "valve_writer", "cut the float air: the vehicle lands"),
)
