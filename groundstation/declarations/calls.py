"""Calls into parts and nodes: what they raise becomes one sentence that names whose it is."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import packages_distributions

from groundstation.declarations.errors import NodeError, UsageError
from groundstation.files.errors import FileError

FOR_THE_TRACE = "(traceback with --debug or GROUNDSTATION_DEBUG=1)"
_OURS = "groundstation"
_KEY = re.compile(r"[a-z_]\w*(\.\w+)*: ")
_LONGEST_WORD, _LONGEST_TEXT = 300, 1000


def shortened(text: str, most: int = 80) -> str:
    """A text of at most so many characters, and three dots where more were cut off."""
    return text if len(text) <= most else f"{text[:most]}..."


def in_one_line(text: str) -> str:
    """A text for a sentence: no line breaks, no control characters, values of thousands of characters cut."""
    line = shortened(" ".join(shortened(word, _LONGEST_WORD) for word in text.split()), _LONGEST_TEXT)
    return "".join(each if each.isprintable() else each.encode("unicode_escape").decode() for each in line)


def described(error: BaseException) -> str:
    """An exception that nobody foresaw: its class and its text."""
    text = in_one_line(str(error))
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def foreign_package(kind: type) -> str:
    """Name of the installed package that a class comes from; empty if it is one of ours."""
    module = kind.__module__.partition(".")[0]
    return "" if module == _OURS else packages_distributions().get(module, [module])[0]


def node_error(key: str, kind: type, error: BaseException) -> NodeError:
    """The sentence about a node that raised something.

    Args:
        key: Of the node, as in journals.
        kind: Its class.
        error: What it raised.
    """
    package = foreign_package(kind)
    whose = f" of the package {package}" if package else ""
    return NodeError(f"{key}{whose} raised {described(error)} {FOR_THE_TRACE}")


@contextmanager
def calling(title: str, what: str) -> Iterator[None]:
    """Call something that a part declares.

    Args:
        title: The part, as sentences name it.
        what: What of it is called.

    Raises:
        UsageError: It raised something else than a sentence.
        ValueError: It refuses what it was given; the text begins with a key or with the part.
    """
    try:
        yield
    except (UsageError, FileError):
        raise
    except ValueError as error:
        text = in_one_line(str(error))
        raise ValueError(text if _KEY.match(text) else f"{title}: {text}") from error
    except (Exception, SystemExit) as error:
        raise UsageError(f"{title}: {what} raised {described(error)}") from error
