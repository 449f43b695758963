"""Files written whole or not at all, alone or several together."""

import errno
import itertools
import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from groundstation.files.errors import FileError

Content = bytes | str | Iterable[str]


def check_targets(*paths: Path | None, sources: Iterable[Path | None] = ()) -> None:
    """Refuse targets that cannot be written, or must not be, before any work is done.

    Args:
        paths: What will be written; None is nothing.
        sources: What will be read, there or not; a folder stands for the files directly in it.

    Raises:
        FileError: A folder does not exist or is not ours to write in, a name is too long, a target is
            a folder or a device, one of the sources, or the same file as another target.
    """
    targets = [path for path in paths if path is not None]
    for path in targets:
        try:
            if path.is_dir():
                raise FileError(f"{path}: cannot be written, it is a folder.")
            if not path.parent.is_dir():
                raise FileError(f"{path}: cannot be written, there is no folder {path.parent}.")
            if path.exists() and not path.is_file():
                raise FileError(f"{path}: cannot be written, it is no file.")
        except OSError as error:
            raise FileError(f"{path}: cannot be written ({error.strerror or error}).") from error
        if not os.access(path.parent, os.W_OK):
            raise FileError(f"{path}: cannot be written, the folder may not be written in.")
    for path, other in itertools.combinations(targets, 2):
        if _is_same(path, other):
            raise FileError(f"{other}: is to be written twice: give each result a name of its own.")
    for source in sources:
        for path in targets:
            if source is not None and _is_read(path, source):
                raise FileError(f"{path}: is a file that is read: give what is written another name.")


def _is_same(one: Path, other: Path) -> bool:
    """Whether two paths are one file, by links or capital letters, too; it need not be there."""
    try:
        return one.resolve() == other.resolve() or one.samefile(other)
    except (OSError, RuntimeError):
        return False


def _is_read(path: Path, source: Path) -> bool:
    return _is_same(path, source) or (source.is_dir() and _is_same(path.parent, source) and path.exists())


def check_folder(path: Path, sources: Iterable[Path] = ()) -> None:
    """Refuse a folder that cannot be made or written in, before any work is done; its parents are made, too.

    Raises:
        FileError: Something of its path is no folder, is not ours to write in, or is too long, or it is one
            of the sources.
    """
    if any(_is_same(path, source) for source in sources):
        raise FileError(f"{path}: is a folder that is read: give what is written another name.")
    try:
        there = next((each for each in (path, *path.parents) if each.exists()), path)
    except OSError as error:
        raise FileError(f"{path}: no such folder can be made ({error.strerror or error}).") from error
    if not there.is_dir():
        raise FileError(f"{path}: no such folder can be made, {there} is none.")
    try:
        tempfile.TemporaryDirectory(dir=there, prefix=".part.").cleanup()
    except OSError as error:  # some file systems take no folders though they grant the right
        raise FileError(
            f"{path}: no such folder can be made in {there} ({error.strerror or error})."
        ) from error


def write_files(contents: Mapping[Path, Content]) -> None:
    """Write all of them, or leave what was there.

    Args:
        contents: Bytes, text or lines by the file they go to.

    Raises:
        FileError: A folder does not exist or cannot be written.
    """
    parts: dict[Path, Path] = {}
    path = Path()
    try:
        for number, (path, content) in enumerate(contents.items()):
            parts[path] = path.with_name(f".{os.getpid()}_{number}.part")  # short, as long as the name may be
            with parts[path].open("wb") as file:
                if isinstance(content, bytes):
                    file.write(content)
                else:
                    file.writelines(map(_utf8, [content] if isinstance(content, str) else content))
        for path in parts:
            if path.is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            if path.exists() and not path.is_file():  # a device or a pipe would be replaced by a file
                raise OSError(errno.EINVAL, "it is no file")
        for path, part in parts.items():
            os.replace(part, path)  # noqa: PTH105 - the call that promises atomicity
    except OSError as error:
        raise FileError(f"{path}: cannot be written ({error.strerror or error}).") from error
    finally:
        for part in parts.values():
            part.unlink(missing_ok=True)


def _utf8(text: str) -> bytes:
    """Encode; names of files that the locale could not decode are decoded as UTF-8."""
    try:
        return text.encode()
    except UnicodeEncodeError:
        return text.encode(errors="surrogateescape").decode(errors="replace").encode()


def write_file(path: Path, content: Content) -> None:
    """Write one file whole or not at all.

    Raises:
        FileError: The folder does not exist or cannot be written.
    """
    write_files({path: content})


@contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """Give an empty folder whose files come to ``path`` when all has gone well, and nowhere otherwise.

    Files that are there already stay unless a new one has their name. Without files no folder is made.

    Raises:
        FileError: The folder cannot be made, a file is in its place, or the disk takes no more.
    """
    try:
        if path.exists() and not path.is_dir():
            raise FileExistsError(errno.EEXIST, "a file is in its place")
        path.exists()  # a name that is too long is refused before any work is done
        made = tempfile.TemporaryDirectory(dir=path.parent, prefix=".part.")
    except OSError as error:
        raise FileError(f"{path}: no such folder can be made ({error.strerror or error}).") from error
    with made as unfinished:
        try:
            yield Path(unfinished)
            for file in sorted(Path(unfinished).iterdir()):
                path.mkdir(exist_ok=True)
                file.replace(path / file.name)
        except FileError as error:  # it names the folder that was asked for
            if unfinished not in str(error):
                raise
            raise FileError(str(error).replace(unfinished, str(path))) from error
        except OSError as error:
            if error.filename is not None and not str(error.filename).startswith(unfinished):
                raise  # of a file that was read
            raise FileError(f"{path}: cannot be written ({error.strerror or error}).") from error
