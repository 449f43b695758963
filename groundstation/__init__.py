"""Ground station for planar satellite testbeds.

Rooms, from the top: ``cli``, ``runtime``, ``nodes``, ``recording`` and ``bus``, the mathematics
(``star_tracking``, ``fusion``, ``control``), ``messages``, ``frames``. Imports point downwards only.
"""
