"""What pydantic finds wrong with a file, in one sentence."""

from collections.abc import Callable, Iterable, Sequence

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from groundstation.declarations.calls import in_one_line, shortened

Spelled = Callable[[Sequence[str | int]], Iterable[str]]
_OWN_WORDS = {
    "model_type": "expected a table of keys",
    "model_attributes_type": "expected a table of keys",
    "dict_type": "expected a table of keys",
    "list_type": "expected a list",
    "tuple_type": "expected a list",
    "too_short": "expected at least {min_length} of them",
    "too_long": "expected at most {max_length} of them",
}
"""For what pydantic says in words of Python."""


def first_sentence(error: ValidationError, spelled: Spelled = lambda way: map(str, way)) -> str:
    """The first mistake with its key; a typo goes before the key that it leaves missing.

    Args:
        error: All mistakes.
        spelled: Makes the words of a key of the way to a mistake.
    """
    found = error.errors()
    typos = [each for each in found if each["type"] == "extra_forbidden"]
    first = (typos or found)[0]
    where = ".".join(spelled([part for part in first["loc"] if part != "[key]"]))
    if first["type"] == "extra_forbidden":
        return f"'{where}' is no known key (a typo?)"
    if first["type"] == "missing":
        return f"'{where}' is missing"
    value = "" if first["type"] == "value_error" else f", found {shortened(repr(first['input']))}"
    return in_one_line(f"{where + ': ' if where else ''}{message_of(first)}{value}")


def message_of(mistake: ErrorDetails) -> str:
    """What was expected, in words that need no Python."""
    own = _OWN_WORDS.get(mistake["type"])
    if own is not None:
        return own.format(**mistake.get("ctx", {}))
    return mistake["msg"].removeprefix("Value error, ")
