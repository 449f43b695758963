"""What can be requested of a controller."""

from groundstation.declarations.request import Action, Argument

FARTHEST_M, MOST_TURNED_RAD = 100.0, 1000.0
"""Beyond what anybody means: the table is smaller, and a controller turns the shorter way."""

GO_TO = Action(
    "go_to",
    "controller",
    "hold another pose",
    (
        Argument("x_m", "table x of the centre of mass", low=-FARTHEST_M, high=FARTHEST_M),
        Argument("y_m", "table y of the centre of mass", low=-FARTHEST_M, high=FARTHEST_M),
        Argument(
            "heading_rad",
            "from table +x to body +x, counter-clockwise",
            low=-MOST_TURNED_RAD,
            high=MOST_TURNED_RAD,
        ),
    ),
)

CHANGE_CONTROLLER = Action(
    "change_controller",
    "controller",
    "fly by another controller; it holds where it is until resume, where it has a program",
    (
        Argument("controller", "a row of the table of controllers", kind=str),
        Argument(
            "parameters", "JSON object of its parameters, as in a rig", kind=str, longest=4000, default="{}"
        ),
    ),
)
