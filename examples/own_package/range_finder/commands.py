"""The command that this package adds; imported for every overview, so it holds nothing else."""

from groundstation.cli.command import Command

RANGES = Command("range_finder.ranges:ranges", "Print what range finders measured in a recording.")
