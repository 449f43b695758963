"""What pydantic finds wrong with a file, in one sentence."""

from pydantic import ValidationError

from groundstation.declarations.calls import in_one_line, shortened


def first_sentence(error: ValidationError) -> str:
    """The first mistake with its key; a typo goes before the key that it leaves missing."""
    found = error.errors()
    typos = [each for each in found if each["type"] == "extra_forbidden"]
    first = (typos or found)[0]
    where = ".".join(str(part) for part in first["loc"] if part != "[key]")
    message = first["msg"].removeprefix("Value error, ")
    if first["type"] == "extra_forbidden":
        return f"'{where}' is no known key (a typo?)"
    if first["type"] == "missing":
        return f"'{where}' is missing"
    value = "" if first["type"] == "value_error" else f", found {shortened(repr(first['input']))}"
    return in_one_line(f"{where + ': ' if where else ''}{message}{value}")
