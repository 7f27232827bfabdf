"""Files written whole or not at all, and text read within bounds."""

from __future__ import annotations

import errno
import hashlib
import os
import secrets
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from tauhat.errors import OutputError, TauhatError

LARGEST_TEXT = 64 * 2**20  # [bytes] descriptions, maps and estimates are far smaller
_BLOCK = 2**20


def replace_file(path: str | Path, write: Callable[[Path], object]) -> None:
    """Write a file beside its place, then rename it: readers see the old file or the new one, never a part.

    Parameters
    ----------
    path : the file to make or replace
    write : writes everything to the path it is given

    Raises
    ------
    OutputError
        full disk, missing folder, no permission; nothing is left behind and an older file stays as it was.
    """
    target = check_output(path)
    part = target.with_name(f".{target.name[:40]}.{secrets.token_hex(6)}.part")
    try:
        write(part)
        _flush(part)
        part.replace(target)
    except OSError as error:
        raise _unwritable(path, error) from error
    finally:
        _discard(part)


def check_output(path: str | Path, *, inputs: Iterable[str | Path] = ()) -> Path:
    """Return where a file would be written, links followed; to be asked before long work begins.

    Parameters
    ----------
    inputs : files that are read for it and must not be lost

    Raises
    ------
    OutputError
        a folder, a device or an input in its place, no folder to hold it, no permission.
    """
    try:
        place = _regular(Path(path))
        if not place.parent.is_dir():
            place.parent.stat()
            raise NotADirectoryError(errno.ENOTDIR, "is not in a folder")
        if not os.access(place.parent, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        raise _unwritable(path, error) from error
    if any(_is_same(place, name) for name in inputs):
        raise OutputError("would overwrite a file it is made from", where=path, remedy="choose another name")
    return place


def _is_same(place: Path, name: str | Path) -> bool:
    try:
        return place.samefile(name)
    except (OSError, ValueError):
        return False


def _unwritable(path: str | Path, error: OSError) -> OutputError:
    where = str(path)[:200] or "''"
    return OutputError("cannot be written", where=where, got=_reason(error), remedy=_REMEDIES.get(error.errno or 0, ""))


_REMEDIES = {
    errno.ENOSPC: "free some space or choose another disk",
    errno.EDQUOT: "free some space or choose another disk",
    errno.EFBIG: "the system limits the size of files here: choose another disk",
    errno.EACCES: "choose a folder you may write to",
    errno.EROFS: "choose a folder you may write to",
    errno.ENOENT: "make the folder first",
    errno.ENOTDIR: "choose a folder that exists",
    errno.ENAMETOOLONG: "choose a shorter name",
    errno.EISDIR: "name a file, not a folder",
}


def _regular(target: Path) -> Path:
    """Return where the bytes go, symbolic links followed; refuse folders and devices."""
    place = target.resolve()
    if place.is_dir():
        raise IsADirectoryError(errno.EISDIR, "is a folder")
    if place.exists() and not place.is_file():
        raise OSError(errno.EINVAL, "is not a regular file")
    return place


def _reason(error: OSError) -> str:
    text = error.strerror or str(error)
    return f"{text} (errno {error.errno})" if error.errno else text


def _discard(part: Path) -> None:
    try:
        part.unlink(missing_ok=True)
    except OSError:
        return  # the folder itself refuses; the first error says why


def _flush(path: Path) -> None:
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def write_text(path: str | Path, text: str) -> None:
    """Write UTF-8 text whole or not at all.

    Raises
    ------
    OutputError
        when the file cannot be written.
    """
    replace_file(path, lambda part: part.write_bytes(text.encode("utf-8")))


def read_text(path: str | Path, *, error: type[TauhatError] = TauhatError, largest: int = LARGEST_TEXT) -> str:
    """Return a file's UTF-8 text, refusing what cannot be a description.

    Parameters
    ----------
    error : the error class to raise, of the room that reads
    largest : most bytes accepted

    Raises
    ------
    TauhatError
        of the class `error`: missing, a folder, too large, not UTF-8.
    """
    place = existing_file(path, error=error)
    try:
        with place.open("rb") as file:
            data = file.read(largest + 1)
    except OSError as problem:
        raise error("cannot be read", where=path, got=_reason(problem)) from problem
    if len(data) > largest:
        raise error("absurd size", where=path, expected=f"at most {largest} bytes", got=f"{place.stat().st_size} bytes")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        raise error(
            "not a text file", where=path, expected="UTF-8", got=f"byte {data[problem.start]:#04x}"
        ) from problem


def existing_file(path: str | Path, *, error: type[TauhatError]) -> Path:
    """Return the path of a regular file that exists.

    Raises
    ------
    TauhatError
        of the class `error`, when there is none.
    """
    place = Path(path)
    try:
        if place.is_file():
            return place
        found = "a folder" if place.is_dir() else "not a regular file" if place.exists() else ""
    except (OSError, ValueError) as problem:
        raise error(
            "not a usable file name", where=repr(str(path)[:80]), got=getattr(problem, "strerror", "") or problem
        ) from problem
    if found:
        raise error("cannot be read", where=path, expected="a file", got=found)
    raise error("no such file", where=path, remedy="check the path")


def sha256_of(paths: Sequence[Path]) -> str:
    """Return the SHA-256 of one file's bytes, or of several files one after the other."""
    digest = hashlib.sha256()
    for path in paths:
        with path.open("rb") as file:
            while block := file.read(_BLOCK):
                digest.update(block)
    return digest.hexdigest()
