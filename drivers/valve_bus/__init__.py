"""The valves of every vehicle on one CAN bus: wire format, guard, port."""
