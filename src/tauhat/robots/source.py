"""Reading a robot description from a file or from text, with a limit on its size."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tauhat.errors import RobotError


@dataclass(frozen=True, slots=True, kw_only=True)
class DescriptionSource:
    """The bytes of a description and where they came from.

    content : the description itself, UTF-8 when it was given as text
    where : file name for messages, or "text"
    name : what a robot is called whose description does not say
    """

    content: bytes
    where: str
    name: str


def source_from_text(text: str, *, most_bytes: int) -> DescriptionSource:
    """Return a description given as text.

    Raises
    ------
    RobotError
        larger than `most_bytes`, or not encodable.
    """
    try:
        content = text.encode()
    except UnicodeEncodeError as error:
        raise RobotError("the description holds characters that are no text", got=error.reason) from error
    _check_size(len(content), most_bytes=most_bytes, where="text")
    return DescriptionSource(content=content, where="text", name="robot")


def source_from_file(path: str | Path, *, most_bytes: int) -> DescriptionSource:
    """Return a description read from a file.

    Raises
    ------
    RobotError
        missing, not a regular file, unreadable, empty, or larger than `most_bytes`.
    """
    where = str(path)[:200]
    try:
        file = Path(path)
        if not file.is_file():
            remedy = "give the path of a .urdf or .toml file"
            raise RobotError("no such robot description", where=where, remedy=remedy)
        with file.open("rb") as stream:
            content = stream.read(most_bytes + 1)
    except OSError as error:
        raise RobotError("the robot description cannot be read", where=where, got=error.strerror) from error
    except ValueError as error:
        raise RobotError("not a path", where=where, got=error) from error
    _check_size(len(content), most_bytes=most_bytes, where=where)
    if not content.strip():
        raise RobotError("the robot description is empty", where=where)
    return DescriptionSource(content=content, where=where, name=file.stem)


def _check_size(size: int, *, most_bytes: int, where: str) -> None:
    if size > most_bytes:
        expected = f"at most {most_bytes / 1e6:g} MB"
        raise RobotError("the robot description is absurdly large", where=where, expected=expected)
