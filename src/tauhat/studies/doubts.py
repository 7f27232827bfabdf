"""The chapter of what the library doubted or refused while a study ran."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from tauhat.studies.study import Chapter, Table

_MOST = 10  # texts of each kind


def doubts_chapter(failures: Iterable[str], doubts: Iterable[str], *, of: str) -> Chapter | None:
    """Return failures and warnings with how often there were; None where there was none.

    Parameters
    ----------
    failures : why there is no model; empty texts do not count
    doubts : texts of warnings
    of : what they are counted in
    """
    refused = Counter(text for text in failures if text)
    rows = [("no model", text, count) for text, count in refused.most_common(_MOST)]
    rows += [("warning", text, count) for text, count in Counter(doubts).most_common(_MOST)]
    if not rows:
        return None
    table = Table(
        title="Warnings and failures",
        header=("kind", "in the words of the library", f"of the {of}"),
        rows=tuple(rows),
        note=f"The {_MOST} commonest of each kind.",
    )
    return Chapter(title="What the library doubted", text=(), tables=(table,))
