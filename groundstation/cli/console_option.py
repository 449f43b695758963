"""Options of ``run`` that are about the console, and the address that it prints."""

from pathlib import Path
from typing import Annotated

import typer

from groundstation.console.access import Access, new_token
from groundstation.console.options import attendant
from groundstation.declarations.errors import UsageError
from groundstation.launch.attendant import Attendant
from groundstation.launch.listening import first_free

FIRST_PORT, PORTS_TRIED = 8400, 100

NoConsole = Annotated[bool, typer.Option("--no-console", help="Start no web console.")]
ConsoleHost = Annotated[
    str,
    typer.Option(
        "--console-host",
        help="Address of this machine at which a network reaches the console; wants --console-certificates.",
    ),
]
ConsolePort = Annotated[
    int, typer.Option("--console-port", help="The next free one if it is taken.", min=1, max=65535)
]
Certificates = Annotated[
    Path | None,
    typer.Option("--console-certificates", help="Folder that `groundstation certificates` made."),
]
HOST = "127.0.0.1"


def console_access(host: str, port: int, certificates: Path | None) -> Access:
    """How the console of a run is reached.

    Raises:
        UsageError: A network is to reach it without certificates, or no port is free.
    """
    if certificates is None:
        access = Access(host, _free(host, port))
    else:
        pair = [certificates / name for name in ("server.pem", "server.key")]
        for file in pair:
            if not file.is_file():
                raise UsageError(
                    f"{file} is not there: `groundstation certificates --out {certificates}` makes it"
                )
        observer, operator = new_token(), new_token()
        names = _names_of(pair[0])
        access = Access(host, _free(host, port), names, observer, operator, *map(str, pair))
    trouble = access.trouble()
    if trouble:
        raise UsageError(trouble)
    return access


def attendants(
    host: str,
    port: int,
    certificates: Path | None,
    *,
    no_console: bool,
    scenario: tuple[str, Path] | None = None,
) -> list[Attendant]:
    """The console beside a run; nothing where none is wanted.

    Raises:
        UsageError: It cannot be opened so.
    """
    if no_console:
        return []
    return [attendant(console_access(host, port, certificates), scenario)]


def _names_of(certificate: Path) -> tuple[str, ...]:
    """Names and addresses that a certificate is for: those that a browser may call this console by.

    Raises:
        UsageError: It is no certificate.
    """
    from cryptography import x509  # only where a network is let in

    try:
        read = x509.load_pem_x509_certificate(certificate.read_bytes())
        found = read.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except (ValueError, OSError, x509.ExtensionNotFound) as error:
        raise UsageError(f"{certificate} is no certificate with names of this machine: {error}") from error
    names = found.get_values_for_type(x509.DNSName)
    return (*names, *map(str, found.get_values_for_type(x509.IPAddress)))


def _free(host: str, first: int) -> int:
    return first_free(host, first, PORTS_TRIED, "--console-host")
