import threading
from contextlib import contextmanager

import pytest

from firmware_emulator.live.server import LiveLaboratory


@contextmanager
def serve(config):
    laboratory = LiveLaboratory(config, seed=1)
    thread = threading.Thread(target=laboratory.run)
    thread.start()
    try:
        yield laboratory.addresses
    finally:
        laboratory.stop()
        thread.join()
        laboratory.close()


@pytest.fixture
def serving():
    """Serves a scenario live while a block runs, and gives the addresses of its channels."""
    return serve
