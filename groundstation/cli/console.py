"""``groundstation console``: the web console over a recording."""

from pathlib import Path
from typing import Annotated

import typer

from groundstation.cli.console_option import FIRST_PORT, HOST, console_access
from groundstation.declarations.errors import UsageError
from groundstation.recording.errors import RecordingError

app = typer.Typer(rich_markup_mode=None)


@app.command()
def console(
    recording: Annotated[Path, typer.Argument(help="Recording (.mcap).")],
    beside: Annotated[
        Path | None, typer.Option(help="Another recording, laid over it from its beginning.")
    ] = None,
    port: Annotated[
        int, typer.Option(help="The next free one if it is taken.", min=1, max=65535)
    ] = FIRST_PORT,
) -> None:
    """Look at a recording in the web console: play, scrub, jump to faults, compare with another one.

    A flight's own console is started by `groundstation run`. Ctrl-C ends it.

    Example: groundstation console recordings/run.mcap --beside recordings/before.mcap
    """
    from groundstation.console.replay import look_at  # what only the server needs

    access = console_access(HOST, port, None)

    def greet() -> None:
        for line in access.greeting:
            print(line, flush=True)

    try:
        look_at(recording, beside, access, greet)
    except RecordingError as error:
        raise UsageError(str(error)) from error
