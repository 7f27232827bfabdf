"""One run a folder at a time, and what killed runs left behind."""

from __future__ import annotations

import errno
import json
import os
import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import IO

from tauhat.errors import OutputError, ProjectError
from tauhat.project.manifest import STATE

_BUSY = {errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES, errno.EDEADLK}
_PART = re.compile(r"\.(.{1,40})\.[0-9a-f]{12}\.part")  # as `tauhat.files` names what it writes beside


@contextmanager
def only_run(folder: Path) -> Iterator[None]:
    """Hold the folder for one run.

    The lock is the operating system's, on an open file: it ends with the process, however that ends, so a lock that a
    killed run left is none. The file's text only tells others who it is; it is never deleted, since whoever waits for a
    deleted file and whoever makes it anew would both believe that they hold it.

    Raises
    ------
    ProjectError
        when another run works in the folder, or it cannot be locked.
    """
    path = folder / STATE / "lock"
    try:
        path.parent.mkdir(exist_ok=True)
        file = path.open("a+", encoding="utf-8")
    except OSError as error:
        raise OutputError("the project's folder cannot be written to", where=folder, got=error.strerror) from error
    with file:
        try:
            _take(file)
        except OSError as error:
            raise _refusal(folder, path, error) from error
        file.truncate(0)
        json.dump({"pid": os.getpid(), "since": datetime.now(UTC).isoformat(timespec="seconds")}, file)
        file.flush()
        yield
        file.truncate(0)


def _take(file: IO[str]) -> None:
    if sys.platform == "win32":
        import msvcrt

        file.seek(2**20)  # a byte beyond the text, so that others can read who it is
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)


def _refusal(folder: Path, path: Path, error: OSError) -> ProjectError:
    if error.errno not in _BUSY:
        return ProjectError("the folder cannot be locked", where=folder, got=error.strerror)
    return ProjectError("another run works in this folder", where=folder, got=_holder(path), remedy="wait for its end")


def _holder(path: Path) -> str:
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
        return f"process {held['pid']}, since {held['since']}"
    except (OSError, ValueError, KeyError, TypeError):
        return "a process that does not tell its number"


def remove_unfinished(outputs: Iterable[Path]) -> tuple[Path, ...]:
    """Delete what killed runs wrote beside these files and did not rename; return it."""
    wanted = {(path.parent, path.name[:40]) for path in outputs}
    removed = []
    for folder in sorted({folder for folder, _ in wanted if folder.is_dir()}):
        for path in sorted(folder.glob(".*.part")):
            named = _PART.fullmatch(path.name)
            if named and (folder, named[1]) in wanted:
                path.unlink(missing_ok=True)
                removed.append(path)
    return tuple(removed)
