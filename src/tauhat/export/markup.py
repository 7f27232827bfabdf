"""XML as text with places: elements and attributes know their bytes, and an edit leaves all other bytes alone."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple
from xml.parsers import expat

from tauhat.errors import ExportError

_ATTRIBUTE = re.compile(rb"""\s+([^\s=/>]+)\s*=\s*("[^"]*"|'[^']*')""")
_DECLARED = re.compile(rb"""^\s*<\?xml[^>]*?\bencoding\s*=\s*["']([A-Za-z0-9._-]+)["']""")
_BYTE_ORDER_MARKS = ((codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be"))


class Span(NamedTuple):
    """Bytes `start` to `stop`, end excluded."""

    start: int
    stop: int


class Edit(NamedTuple):
    """Other bytes in place of a span; an insertion where the span is empty."""

    span: Span
    text: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """An element of the document and where it stands.

    tag : name of the element
    opening : its start tag, or all of it when it closes itself
    closing : its end tag; empty, behind the element, when it closes itself
    attributes : name -> place of the value, without its quotes
    texts : name -> value as written
    end_of_attributes : where another attribute can be put
    children : elements inside, in order
    """

    tag: str
    opening: Span
    closing: Span
    attributes: Mapping[str, Span]
    texts: Mapping[str, str]
    end_of_attributes: int
    children: tuple[Place, ...]

    @property
    def closes_itself(self) -> bool:
        """Whether it is written `<tag/>`."""
        return self.closing.start == self.closing.stop

    def child(self, tag: str) -> Place | None:
        """Return the first child of that tag."""
        return next(iter(self.named(tag)), None)

    def named(self, tag: str) -> Iterable[Place]:
        """Return all children of that tag."""
        return (child for child in self.children if child.tag == tag)


@dataclass(frozen=True, slots=True, kw_only=True)
class Markup:
    """A document as UTF-8 bytes, its tree of places, and what turns the bytes back into the file's own.

    text : UTF-8, whatever the file's encoding
    root : the outermost element
    encoding, mark : of the file; the mark is its byte order mark
    """

    text: bytes
    root: Place
    encoding: str
    mark: bytes

    def edited(self, edits: Iterable[Edit]) -> bytes:
        """Return the file with the edits made, in the file's own encoding; spans must not overlap."""
        parts, done = [], 0
        for edit in sorted(edits, key=lambda edit: edit.span):
            parts += [self.text[done : edit.span.start], edit.text]
            done = edit.span.stop
        whole = b"".join([*parts, self.text[done:]])
        return self.mark + _recoded(whole, "utf-8", self.encoding)

    def decoded(self, content: bytes) -> str:
        """Return what `edited` gave as text."""
        return content[len(self.mark) :].decode(self.encoding)


def _recoded(content: bytes, before: str, after: str) -> bytes:
    return content if before == after else content.decode(before).encode(after)


def read_markup(content: bytes, *, where: str, encoding: str = "") -> Markup:
    """Return well-formed XML with the places of its elements.

    Parameters
    ----------
    encoding : of the content, when it is known better than the document itself can say

    Raises
    ------
    ExportError
        in an encoding that cannot be written back as it was.
    """
    mark, told = _encoding(content)
    encoding = encoding or told
    body = content[len(mark) :]
    try:
        text = _recoded(body, encoding, "utf-8")
        returned = _recoded(text, "utf-8", encoding)
    except (UnicodeError, LookupError) as error:
        raise ExportError("the file's encoding cannot be read", where=where, got=f"{encoding}: {error}") from error
    if returned != body:
        raise ExportError("the file's encoding cannot be written back as it was", where=where, got=encoding)
    try:
        root = _Surveyor(text).root()
    except expat.ExpatError as error:
        raise ExportError("not well-formed XML", where=where, got=error) from error
    return Markup(text=text, root=root, encoding=encoding, mark=mark)


def _encoding(content: bytes) -> tuple[bytes, str]:
    for mark, encoding in _BYTE_ORDER_MARKS:
        if content.startswith(mark):
            return mark, encoding
    declared = _DECLARED.match(content[:400])
    name = declared.group(1).decode("ascii") if declared else "utf-8"
    try:
        return b"", codecs.lookup(name).name
    except LookupError:
        return b"", name


class _Open(NamedTuple):
    """An element whose end has not come yet; attributes and children are still being collected."""

    opening: Span
    attributes: dict[str, Span]
    end_of_attributes: int
    children: list[Place]


class _Surveyor:
    """Follows expat through the document and notes where each element begins and ends."""

    def __init__(self, text: bytes) -> None:
        self._text = text
        self._parser = expat.ParserCreate("utf-8")
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._open = [_Open(Span(0, 0), {}, 0, [])]

    def root(self) -> Place:
        self._parser.Parse(self._text, True)
        return self._open[0].children[0]

    def _start(self, tag: str, _: dict[str, str]) -> None:
        start = self._parser.CurrentByteIndex
        position = start + 1 + len(tag.encode())
        attributes: dict[str, Span] = {}
        while found := _ATTRIBUTE.match(self._text, position):
            attributes[found.group(1).decode()] = Span(found.start(2) + 1, found.end(2) - 1)
            position = found.end()
        stop = self._text.index(b">", position) + 1
        self._open.append(_Open(Span(start, stop), attributes, position, []))

    def _end(self, tag: str) -> None:
        done = self._open.pop()
        behind = done.opening.stop
        closes_itself = self._text[behind - 2 : behind] == b"/>"
        start = behind if closes_itself else self._parser.CurrentByteIndex
        stop = behind if closes_itself else self._text.index(b">", start) + 1
        texts = {name: self._text[span.start : span.stop].decode() for name, span in done.attributes.items()}
        place = Place(
            tag=tag,
            opening=done.opening,
            closing=Span(start, stop),
            attributes=done.attributes,
            texts=texts,
            end_of_attributes=done.end_of_attributes,
            children=tuple(done.children),
        )
        self._open[-1].children.append(place)


def with_attributes(place: Place, values: Mapping[str, str]) -> list[Edit]:
    """Return the edits that give attributes these values: in their places, or behind the others."""
    known = [Edit(place.attributes[name], value.encode()) for name, value in values.items() if name in place.attributes]
    new = "".join(f' {name}="{value}"' for name, value in values.items() if name not in place.attributes)
    here = Span(place.end_of_attributes, place.end_of_attributes)
    return [*known, Edit(here, new.encode())] if new else known


def with_child(markup: Markup, place: Place, lines: Iterable[str]) -> Edit:
    """Return the edit that puts a new first child into an element, indented like what is there.

    Parameters
    ----------
    lines : of the child, indented among themselves by tabs; joined where the element is on one line
    """
    margin, newline = _margin(markup.text, place)
    if place.children and _margin(markup.text, place.children[0])[0] is None:
        margin, newline = None, ""
    step = "" if margin is None else _step(markup.text, place, margin)
    inside = f"{newline}{margin or ''}{step}" if newline else ""
    text = "".join(f"{inside}{line.replace(chr(9), step)}" for line in lines)
    if not place.closes_itself:
        return Edit(Span(place.opening.stop, place.opening.stop), text.encode())
    ending = f"{newline}{margin or ''}" if newline else ""
    slash = Span(place.opening.stop - 2, place.opening.stop)
    head = markup.text[place.end_of_attributes : slash.start]  # blanks before the slash of `<link name="tool" />`
    whole = f">{text}{ending}</{place.tag}>"
    return Edit(Span(slash.start - len(head), slash.stop), whole.encode())


def _margin(text: bytes, place: Place) -> tuple[str | None, str]:
    """Return the blanks before an element that begins its line, and the line's end; None and "" inside a line."""
    before = text[: place.opening.start]
    line = before[before.rfind(b"\n") + 1 :]
    if b"\n" not in before or line.strip():
        return None, ""
    newline = "\r\n" if before[: len(before) - len(line)].endswith(b"\r\n") else "\n"
    return line.decode(), newline


def _step(text: bytes, place: Place, margin: str) -> str:
    """Return the blanks by which children stand in from an element."""
    for child in place.children:
        inner, _ = _margin(text, child)
        if inner is not None and inner.startswith(margin) and len(inner) > len(margin):
            return inner[len(margin) :]
    return margin or "  "
