"""What can be requested of a controller."""

from groundstation.declarations.request import Action, Argument

GO_TO = Action(
    "go_to",
    "controller",
    "hold another pose",
    (
        Argument("x_m", "table x of the centre of mass"),
        Argument("y_m", "table y of the centre of mass"),
        Argument("heading_rad", "from table +x to body +x, counter-clockwise"),
    ),
)
