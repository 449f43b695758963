"""Thin shells: receive, call the mathematics, emit. No clock, no socket, no thread."""
