"""Experiments as files: who flies, what happens when, what counts as success."""
