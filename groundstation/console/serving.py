"""How a console is served: one place for what uvicorn is told."""

import asyncio
from collections.abc import Callable

import uvicorn

from groundstation.console.impatient import ImpatientProtocol
from groundstation.console.server import make_app
from groundstation.console.shown_console import Console
from groundstation.declarations.errors import UsageError

LISTEN_BACKLOG = 64
LONGEST_MESSAGE = 100_000
LOOK_S = 0.02


def server_of(console: Console) -> uvicorn.Server:
    """A server that listens at the console's address once it is served."""
    access = console.access
    return uvicorn.Server(
        uvicorn.Config(
            make_app(console),
            host=access.host,
            port=access.port,
            ssl_certfile=access.certificate or None,
            ssl_keyfile=access.key or None,
            log_level="warning",
            access_log=False,
            http=ImpatientProtocol,
            ws="websockets-sansio",
            ws_per_message_deflate=False,
            ws_max_size=LONGEST_MESSAGE,
            backlog=LISTEN_BACKLOG,
            timeout_graceful_shutdown=1,
        )
    )


async def serve(server: uvicorn.Server, address: str, listening: Callable[[], None]) -> None:
    """Serve until it is asked to stop.

    Args:
        server: Of a console.
        address: That people open.
        listening: Called once it listens.

    Raises:
        UsageError: It cannot listen there.
    """

    async def wait() -> None:
        while not server.started:
            await asyncio.sleep(LOOK_S)
        listening()

    waiting = asyncio.create_task(wait())
    try:
        await server.serve()
    except SystemExit as error:
        raise UsageError(f"the console cannot listen at {address}: is the port taken?") from error
    finally:
        waiting.cancel()
