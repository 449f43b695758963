"""Commands that installed packages add by entry points of the group ``groundstation.commands``."""

from importlib.metadata import EntryPoint, entry_points

from groundstation.cli.command import Command, Group

GROUP = "groundstation.commands"
Row = Command | Group


class BrokenCommandError(Exception):
    """A command of an installed package cannot be loaded; the message is one sentence."""


def extension(name: str) -> Row | None:
    """Return the command of that name; None if no package adds one.

    Raises:
        BrokenCommandError: It cannot be loaded, or several packages add it.
    """
    found = list(entry_points(group=GROUP, name=name)) if name and not name.startswith("-") else []
    packages = sorted({_package_of(point) for point in found})
    if len(packages) > 1:
        raise BrokenCommandError(f"the command '{name}' is added by {' and by '.join(packages)}: remove one.")
    return _load(found[0]) if found else None


def extensions() -> dict[str, Row]:
    """Return all of them for an overview; one that is broken says so in its line."""
    rows: dict[str, Row] = {}
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        try:
            rows[point.name] = _load(point)
        except BrokenCommandError as error:
            rows[point.name] = Command(point.value, f"(broken: {error})")
    return rows


def _load(point: EntryPoint) -> Row:
    where = f"the command '{point.name}' of {_package_of(point)}"
    try:
        found = point.load()
    except (Exception, SystemExit) as error:  # whatever somebody's package raises while it is imported
        raise BrokenCommandError(f"{where} cannot be loaded ({type(error).__name__}: {error}).") from error
    if not isinstance(found, Command | Group):
        raise BrokenCommandError(
            f"{where}: {point.value} is no Command and no Group of groundstation.cli.command."
        )
    return found


def _package_of(point: EntryPoint) -> str:
    return point.dist.name if point.dist is not None else point.value.partition(":")[0]
