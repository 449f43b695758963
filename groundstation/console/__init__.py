"""The operator's console: a server of pages beside a flight, or over a recording."""
