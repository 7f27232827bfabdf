"""What the sources mean, told to what reads them for the API pages.

Docstrings: the house writes `name : what it is`, in `Parameters` and, for the fields of a class, in a paragraph of its
own. NumPy's style expects a type after the colon, which stands in the signature here, and reads every later paragraph
as one more parameter.

Names: a function that a package exports and that has the name of its module (`tauhat.estimation.identify`) is meant,
not the module.
"""

from __future__ import annotations

import re
from itertools import chain
from typing import Any, NamedTuple

import griffe

_HEADING = re.compile(r"(\w[\w ]*)\n-{3,}\n")
_ITEM = re.compile(r"(\*{0,2}\w+(?:, \*{0,2}\w+)*) : (.*)", re.DOTALL)
_NEXT_ITEM = re.compile(r"\n(?=\S)")


class Section(NamedTuple):
    """Heading and body of a docstring's section."""

    heading: str
    body: str


class HouseStyle(griffe.Extension):
    """Rewrites every docstring before it is parsed, and puts exported functions before modules of their name."""

    def on_package(self, *, pkg: griffe.Module, loader: griffe.GriffeLoader, **kwargs: Any) -> None:  # noqa: ARG002
        """Do both, once the whole package is read and its imports are resolved."""
        loader.resolve_aliases()
        _rewrite(pkg)
        for module in [pkg, *(member for member in pkg.modules.values() if not member.is_alias)]:
            for name in _hidden_by_modules(module):
                module.set_member(name, griffe.Alias(name, module[name][name], parent=module))


def _rewrite(outer: griffe.Object) -> None:
    """Rewrite the docstrings of an object and of all that is in it."""
    if outer.docstring is not None:
        outer.docstring.value = rewritten(outer.docstring.value, "Attributes" if outer.is_class else "Parameters")
    for member in outer.members.values():
        if not member.is_alias:
            _rewrite(member)


def _hidden_by_modules(package: griffe.Module) -> list[str]:
    """Return the exported names of a package that are also those of modules in it."""
    names = [str(name) for name in package.exports or ()]
    return [name for name in names if package[name].is_module and name in package[name].members]


def rewritten(text: str, fields: str) -> str:
    """Return a docstring whose text comes first, and whose items have their description on a line of their own.

    Items outside any section become one that is called as `fields` says.
    """
    plain, *sections = _sections(text)
    prose, items = _told_apart(plain.body)
    found = [Section(fields, _section_body(items))] if items else []
    for section in sections:
        if section.heading not in {"Parameters", "Attributes"}:
            found.append(section)
            continue
        more, items = _told_apart(section.body)
        prose += more
        found.append(Section(section.heading, _section_body(items)))
    parts = [*prose, *(f"{section.heading}\n{'-' * len(section.heading)}\n{section.body}" for section in found)]
    return "\n\n".join(part.strip("\n") for part in parts)


def _sections(text: str) -> list[Section]:
    """Return the text before the first heading, without one, and the sections."""
    before, *rest = _HEADING.split(text)
    return [Section("", before), *(Section(*pair) for pair in zip(rest[::2], rest[1::2], strict=True))]


def _told_apart(body: str) -> tuple[list[str], list[str]]:
    """Return the paragraphs of a text, and the items of those that begin with one."""
    paragraphs = [part for part in body.split("\n\n") if part.strip()]
    prose = [part for part in paragraphs if not _ITEM.match(part)]
    return prose, [part for part in paragraphs if _ITEM.match(part)]


def _section_body(paragraphs: list[str]) -> str:
    return "\n".join(chain.from_iterable(map(_items, paragraphs)))


def _items(paragraph: str) -> list[str]:
    """Return a paragraph's items, one a name, each with its description below it."""
    written = []
    for item in _NEXT_ITEM.split(paragraph.strip("\n")):
        match = _ITEM.match(item)
        if match is None:
            written.append(f"    {item}")
            continue
        names, text = match.groups()
        words = " ".join(text.split())
        written += [f"{name}\n    {words}" for name in names.split(", ")]
    return written
