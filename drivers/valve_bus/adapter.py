"""What python-can's back ends need that is not the same for all: opening, prompt lines, closing."""

import os
import socket
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import can
from can.interfaces.slcan import slcanBus

from drivers.errors import NotFound, Refused
from drivers.socket_url import check_socket_url
from drivers.valve_bus.messages import SILENCE_CLOSES_S
from drivers.valve_bus.slcan_lines import SlcanLines

SLICE_S = 0.1
"""Whoever waits for frames looks this often whether the port is being closed."""


def open_adapter(config: Mapping[str, Any], name: str) -> can.BusABC:
    """Open the adapter of a rig.

    Args:
        config: Keyword arguments of `can.Bus`.
        name: Of the bus, for messages.

    Raises:
        NotFound: It cannot be opened, or python-can lacks a library for it.
    """
    arguments = _with_defaults(config)
    try:
        check_socket_url(str(config["channel"]))
        return can.Bus(**arguments, ignore_config=True)
    except Refused as error:
        raise NotFound(f"the valve bus on {name} cannot be opened: {error}") from error
    except Exception as error:  # whatever a back end raises where its library or its adapter is absent
        raise NotFound(_why_not(name, str(config["interface"]), error)) from error


def _why_not(name: str, interface: str, error: Exception) -> str:
    reason = " ".join(str(error).split()) or type(error).__name__
    sentence = f"the valve bus on {name} cannot be opened: {reason}"
    if isinstance(error, (can.CanError, OSError, ValueError)) and not isinstance(error, ImportError):
        return sentence
    return f"{sentence}; is the library installed that python-can needs for {interface!r}?"


def _with_defaults(config: Mapping[str, Any]) -> dict[str, Any]:
    arguments = dict(config)
    if arguments["interface"] == "slcan":
        # one byte ends the wait; 1 ms would wake a thousand times a second
        arguments.setdefault("timeout", SLICE_S / 2)
        if str(arguments["channel"]).startswith("socket://"):
            arguments.setdefault("sleep_after_open", 0.0)
    return arguments


def prompt_lines(bus: can.BusABC) -> SlcanLines | None:
    """A slcan line must not wait: neither for an acknowledgement (Nagle) nor for ever on a full buffer.

    Returns:
        Its reader; None where the adapter is another.
    """
    port = getattr(bus, "serialPortOrig", None)
    if port is None:
        return None
    port.write_timeout = SILENCE_CLOSES_S
    if str(port.port).startswith("socket://"):
        with socket.socket(fileno=os.dup(port.fileno())) as same_socket:
            same_socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return SlcanLines(port.fileno()) if isinstance(bus, slcanBus) else None


def shut_down(bus: can.BusABC) -> None:
    """On a dead link slcan gives up before it closes its port, and pyserial before it closes its socket."""
    port = getattr(bus, "serialPortOrig", None)
    open_socket = getattr(port, "_socket", None)
    with suppress(can.CanError, OSError):  # that the adapter is dead is no news to somebody who closes it
        bus.shutdown()
    if port is not None:
        port.close()
    if open_socket is not None:
        open_socket.close()
