"""Words for terminals that know ASCII only: a sign that they lack is spelled out and is no error."""

import codecs
import sys

SPELLED = {
    "±": "+/-", "×": "x", "·": "*", "°": " deg", "µ": "u", "μ": "u", "σ": "sigma", "Δ": "d",
    "²": "^2", "³": "^3",
    "…": "...", "–": "-", "—": "-", "−": "-", "→": "->", "≤": "<=", "≥": ">=", "≈": "~", "√": "sqrt ",
    "‘": "'", "’": "'", "“": '"', "”": '"', "•": "*", "●": "*", "│": "|", "─": "-", "└": "+",
    "├": "+",
}  # fmt: skip
HANDLER = "groundstation.spelled"


def speak_any_locale() -> None:
    """Let stdout and stderr spell out what their encoding lacks."""
    codecs.register_error(HANDLER, spell)
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors=HANDLER)


def spell(error: UnicodeError) -> tuple[str | bytes, int]:
    """Spell out the first character that cannot be encoded; bytes of a file's name go out as they are.

    Raises:
        UnicodeError: It is no error of encoding.
    """
    if not isinstance(error, UnicodeEncodeError):
        raise error
    sign = error.object[error.start]
    if 0xDC80 <= ord(sign) <= 0xDCFF:  # what the locale could not decode
        return bytes([ord(sign) - 0xDC00]), error.start + 1
    return SPELLED.get(sign, "?"), error.start + 1
