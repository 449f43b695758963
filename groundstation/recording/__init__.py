"""MCAP recordings: writer, reader, recovery."""
