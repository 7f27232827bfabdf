r"""What MkDocs does not do by itself.

A navigation entry `folder/*` is all pages of that folder, by name. A `\|` in the code of a table's cell is a bar, as
where the pages are read without the site.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig

ALL = "/*"
_ROW = re.compile(r"^\|.*\|$", re.MULTILINE)
_CODE = re.compile(r"`[^`]+`")


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Return the configuration with every `folder/*` of the navigation written out; an empty folder has no entry."""
    config.nav = _written_out(config.nav or [], Path(config.docs_dir))
    return config


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Return a page in which escaped bars in the code of tables are bars."""
    return _ROW.sub(lambda row: _CODE.sub(lambda code: code[0].replace(r"\|", "|"), row[0]), markdown)


def _written_out(entries: list[Any], docs: Path) -> list[Any]:
    written = []
    for entry in entries:
        if not isinstance(entry, dict):
            written.append(entry)
            continue
        ((title, target),) = entry.items()
        pages = _pages(target, docs)
        if pages:
            written.append({title: pages})
    return written


def _pages(target: Any, docs: Path) -> Any:
    if isinstance(target, list):
        return _written_out(target, docs)
    if not target.endswith(ALL):
        return target
    return sorted(page.relative_to(docs).as_posix() for page in (docs / target.removesuffix(ALL)).glob("*.md"))
