"""Words in the comments of programs: names come from descriptions that others wrote."""

from __future__ import annotations


def plain_letters(text: str) -> str:
    """Return a text with ? for every letter that is no printable ASCII, so that it cannot end a line."""
    return "".join(letter if letter.isprintable() and letter.isascii() else "?" for letter in text)
