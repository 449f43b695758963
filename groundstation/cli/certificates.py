"""``groundstation certificates``: an authority, a server and clients, for the console and other hosts."""

import datetime
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from groundstation.declarations.errors import UsageError
from groundstation.launch.certificates import make_all, make_client
from groundstation.launch.guests import OBSERVER, OPERATOR

app = typer.Typer(rich_markup_mode=None)


class Role(StrEnum):
    """What a client may do."""

    OBSERVER = OBSERVER
    OPERATOR = OPERATOR


@app.command()
def certificates(
    out: Annotated[Path, typer.Option(help="Folder; made if it is not there.")],
    host: Annotated[
        list[str] | None,
        typer.Option(help="Name or address that this machine is reached by; may be repeated."),
    ] = None,
    client: Annotated[
        str | None, typer.Option(help="Make one more client, of this name, by the authority in --out.")
    ] = None,
    role: Annotated[Role, typer.Option(help="Of that client.")] = Role.OBSERVER,
) -> None:
    """Make certificates: ca, server, observer and operator, each a .pem and a .key.

    The console and the bus show server.pem to whoever connects; a browser or a program trusts ca.pem. Other
    hosts join the bus with observer (receives) or operator (may also command, under the lease). Files are for
    your eyes only (0600) and never overwritten. Keep ca.key somewhere else: who has it can make operators.

    Example: groundstation certificates --out certificates --host lab-pc.local --host 192.168.1.20

    Example: groundstation certificates --out certificates --client anna --role operator
    """
    now = datetime.datetime.now(datetime.UTC)
    if client is None:
        written = make_all(out, host or (), now)
    elif host:
        raise UsageError("--host goes with a new authority: a client has no host")
    else:
        written = make_client(out, role.value, client, now)
    for path in written:
        print(path)
