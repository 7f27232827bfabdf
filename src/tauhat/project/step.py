"""A step of a project: what it reads, what it writes, and how it is made."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tauhat
from tauhat.files import sha256_of
from tauhat.recordings.mapfile import find_map

_LARGEST_SETTINGS = 2**20  # [bytes] of a TOML file whose named files are looked for


@dataclass(frozen=True, slots=True)
class FileDigests:
    """Digests of files; a file that did not change since is not read again."""

    _known: dict[tuple[Path, int, int, int], str] = field(default_factory=dict)

    def of(self, path: Path) -> str:
        """Return the SHA-256 of a file's bytes, or nothing where there is no file."""
        try:
            now = path.stat()
        except OSError:
            return ""
        key = (path, now.st_ino, now.st_size, now.st_mtime_ns)
        if key not in self._known:
            self._known[key] = sha256_of([path])
        return self._known[key]


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A piece of work whose inputs are known before it begins; paths of outputs are relative to the project's folder.

    settings : label -> value, what it reads of the project's file
    files : what it reads beside that
    awaited : files that it reads and that people bring; while one is missing, the step waits
    reads : outputs of earlier steps that it reads
    outputs : what it writes, each whole or not at all
    make : does the work
    """

    name: str
    settings: Mapping[str, Any]
    outputs: tuple[str, ...]
    make: Callable[[], None]
    files: tuple[Path, ...] = ()
    awaited: tuple[Path, ...] = ()
    reads: tuple[str, ...] = ()

    def missing(self) -> tuple[Path, ...]:
        """Return the awaited files that are not there yet."""
        return tuple(path for path in self.awaited if not path.is_file())

    def inputs(self, folder: Path, digests: FileDigests) -> dict[str, Any]:
        """Return everything the outputs hang on: version, settings, digests of files and of earlier outputs.

        Parameters
        ----------
        folder : the project's; files inside it are named relative to it, so that the folder may move
        """
        every = sorted({*self.files, *self.awaited})
        files = {f"file {_label(path, folder)}": digests.of(path) for path in every}
        earlier = {name: digests.of(folder / name) for name in self.reads}
        return {"tauhat": tauhat.__version__, **self.settings, **files, **earlier}


def digest_of(data: object) -> str:
    """Return the SHA-256 of plain data, whatever the order of its keys."""
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def with_named_files(path: Path) -> tuple[Path, ...]:
    """Return a file and all files that its TOML names, theirs too: an experiment's limits, and the meshes of those."""
    found: dict[Path, None] = {}
    waiting = [path]
    while waiting:
        file = waiting.pop()
        if file not in found:
            found[file] = None
            waiting += list(_named_in(file, file.parent))
    return tuple(found)


def log_files(log: Path, log_map: Path | None) -> tuple[Path, ...]:
    """Return a log with its map, given or beside it, and the further files that the map names."""
    chosen = log_map or find_map(log)
    return (log,) if chosen is None else (log, chosen, *_named_in(chosen, log.parent))


def _named_in(path: Path, folder: Path) -> Iterator[Path]:
    if path.suffix.lower() != ".toml" or not path.is_file() or path.stat().st_size > _LARGEST_SETTINGS:
        return
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError):
        return  # whoever reads it says what is wrong
    for text in _texts_in(data):
        if _is_file(folder, text):
            yield folder / text


def _texts_in(value: object) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _texts_in(item)


def _is_file(folder: Path, text: str) -> bool:
    try:
        return bool(text) and (folder / text).is_file()
    except (OSError, ValueError):
        return False


def _label(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else str(path)
