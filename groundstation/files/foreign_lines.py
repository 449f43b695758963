"""What libraries print on the standard error of this process, past Python: kept away from people.

The decoders of films print lines of their own for every damaged frame, thousands of them. They go into a file
that nobody reads; whether there were any is known.
"""

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stderr
from types import TracebackType
from typing import Self

_STANDARD_ERROR = 2


class ForeignLines:
    """Holds back lines while something foreign runs; to be used as a context, and within it `held`.

    What Python itself prints meanwhile, a progress line of another thread, still comes through.
    """

    def __enter__(self) -> Self:
        self._file, self._kept = tempfile.TemporaryFile(), -1
        try:
            self._kept = os.dup(_STANDARD_ERROR)
        except OSError:  # a process without one shows nobody anything
            return self
        self._through = os.fdopen(self._kept, "w", buffering=1, errors="replace")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        del kind, error, trace
        if self._kept >= 0:
            self._through.close()
        self._file.close()

    @contextmanager
    def held(self) -> Iterator[None]:
        """Hold back what is printed in here."""
        if self._kept < 0:
            yield
            return
        with ExitStack() as stack:
            if _goes_to_standard_error():
                stack.enter_context(redirect_stderr(self._through))
            os.dup2(self._file.fileno(), _STANDARD_ERROR)
            stack.callback(os.dup2, self._kept, _STANDARD_ERROR)
            yield

    def were_there(self) -> bool:
        """Whether any line was held back since this was asked last."""
        found = os.fstat(self._file.fileno()).st_size > 0
        if found:
            os.ftruncate(self._file.fileno(), 0)
            os.lseek(self._file.fileno(), 0, os.SEEK_SET)
        return found


def _goes_to_standard_error() -> bool:
    try:
        return sys.stderr.fileno() == _STANDARD_ERROR
    except (AttributeError, OSError, ValueError):  # there is none, it is closed, or it is no file
        return False
