"""The camera that looks up at the ceiling: newest frame only, stamped at the middle of its exposure."""
