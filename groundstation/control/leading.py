"""Who leads whom. Pure."""

from collections.abc import Mapping


def lost_followers(led_by: Mapping[str, tuple[str, ...]]) -> list[str]:
    """Who comes, over however many leaders, to nobody who knows a place of its own.

    Args:
        led_by: Of each vehicle those without whom it has no place of its own; empty for one that leads.
    """
    led = {name for name, leaders in led_by.items() if not leaders}
    while more := {name for name, leaders in led_by.items() if name not in led and led & set(leaders)}:
        led |= more
    return [name for name in led_by if name not in led]
