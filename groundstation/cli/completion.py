"""Completion by a shell: which command it is about, since only that one is imported.

The rest is typer's own: ``--install-completion`` and ``--show-completion``.
"""

from collections.abc import Mapping

ASKED = "_GROUNDSTATION_COMPLETE"
"""A shell sets it, e.g. to ``complete_bash``, where it wants completions instead of a command."""
_LINES = ("COMP_WORDS", "_TYPER_COMPLETE_ARGS")
"""What has been typed: of bash, and of zsh, fish and PowerShell."""


def typed(environ: Mapping[str, str]) -> list[str] | None:
    """Words behind the program's name that a shell wants completed; None where none does.

    Quotes may be open, so words are cut at spaces; the name of a command has none.
    """
    if not environ.get(ASKED):
        return None
    line = next((environ[name] for name in _LINES if name in environ), "")
    return line.split()[1:]
