"""Names of single numbers in a recording: ``alpha/state.position_table_m[0]``."""

import re

from groundstation.recording.errors import UnknownFieldError

_NAME = re.compile(r"/?(?P<topic>[^.\[\]]+)\.(?P<column>\w+)(?:\[(?P<place>\d+)\])?")


def parse_field(name: str) -> tuple[str, str, int | None]:
    """Topic, column and place in the column's vector.

    Raises:
        UnknownFieldError: It is no such name.
    """
    found = _NAME.fullmatch(name.strip())
    if found is None:
        raise UnknownFieldError(
            f"{name!r} names no field: topic, dot, field, as in alpha/state.heading_rad or "
            "alpha/state.position_table_m[0]"
        )
    return found["topic"], found["column"], None if found["place"] is None else int(found["place"])
