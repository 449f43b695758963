"""A rig that runs: what status and watch show of it, and that nobody but this host reaches it."""

import csv
import json
import socket

import pytest
from oracles import listening

pytestmark = pytest.mark.slow


def test_the_kernel_lists_what_is_listened_on():
    with socket.socket() as everywhere, socket.socket(socket.AF_INET6) as here:
        for server, address in ((everywhere, "0.0.0.0"), (here, "::1")):
            server.bind((address, 0))
            server.listen()
        found = {(str(address), port) for _, address, port in listening.listened_on(["self"])}
        ports = everywhere.getsockname()[1], here.getsockname()[1]
        assert {("0.0.0.0", ports[0]), ("::1", ports[1])} <= found


def test_by_default_nothing_but_loopback_is_listened_on_and_status_and_watch_see_the_flight(
    launch, two_drawn
):
    run = launch(two_drawn, has_console=True)
    run.wait_until_flying()
    run.rewind()
    run.wait_for("console: http://127.0.0.1:")
    listened = listening.listened_on(run.every_pid())
    assert len(listened) >= 3, "hub, console, and the laboratory's serial lines and CAN bus"
    assert not [each for each in listened if not listening.is_loopback(each[1])]

    status = run._call("status", "--json")
    (rig,) = json.loads(status.stdout)
    for name, seen in rig["vehicles"].items():
        shown = f"{name}: {seen['mode']} ({seen['cause']}"
        assert any(shown in line for line in run.lines), shown
        assert seen["air_on"] in (True, False)
        assert seen["pressure_pa"] > 1e5
        assert seen["faults"] is not None
    assert rig["recorder"]["written_bytes"] > 0
    assert "bar" in run._call("status").stdout

    watched = run._call("watch", "alpha/state.heading_rad", "--count", "50")
    rows = list(csv.DictReader(watched.stdout.splitlines()))
    assert len(rows) == 50
    stamps = [float(row["stamp_s"]) for row in rows]
    assert stamps == sorted(stamps)
    assert all(abs(float(row["heading_rad"])) < 0.5 for row in rows)
    run.end_in_order()
