"""What can be requested of a vehicle as a whole."""

from groundstation.declarations.request import Action, Argument, table_of

OVERRIDE = Argument(
    "override", "reason to fly in spite of checks that a person may override", str, default=""
)

ACTIONS = table_of(
    Action("fly", "supervisor", "take off once every check passes, and let the controller fly", (OVERRIDE,)),
    Action("land", "supervisor", "cut the float air now; only a person lets it fly again"),
    Action("stop", "supervisor", "brake, hold, land, and latch it; pressed again: land at once"),
    Action("release", "supervisor", "end a latched stop, clear faults that are gone; it stays landed"),
    Action("arm", "supervisor", "let valves open; the controller commands once it floats", (OVERRIDE,)),
    Action("disarm", "supervisor", "close all valves and cut the float air"),
    Action("float_on", "supervisor", "switch the float air on; an unarmed vehicle then slides"),
    Action("float_off", "supervisor", "cut the float air: the vehicle lands"),
    Action("brake", "supervisor", "take the speed away and hold still, whatever the controller says"),
    Action("resume", "supervisor", "end braking or pushing"),
)
