"""A project that is quick to go through, and what a test asks of a folder."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import tauhat

TEXT = """
[robot]
source = "two_link"

[motion]
seconds = 4.0
periods = 1
harmonics = 3
starts = 1

[record]
rate = 200.0

[identify]
model = "plain"
constraints = "physical"

[verify]
seconds = 4.0

[export]
formats = ["urdf", "c"]
"""
ROBOT_FILE = Path(tauhat.__file__).parent / "robots" / "data" / "two_link.toml"
_WRITTEN = re.compile(rb"\d{4}-\d\d-\d\d \d\d:\d\d UTC")  # the report says when it was written
STEPS = ["robot", "motion", "record", "unseen", "check", "identify", "export", "verify", "report"]


def new_folder(folder: Path, text: str = TEXT) -> Path:
    folder.mkdir(parents=True)
    (folder / "project.toml").write_text(text, encoding="utf-8")
    return folder


def left_in(folder: Path) -> dict[str, str]:
    """Return every file of a project's folder with the digest of its content, the time in the report left out."""
    files = sorted(path for path in folder.rglob("*") if path.is_file() and ".tauhat" not in path.parts)
    contents = {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}
    return {name: hashlib.sha256(_WRITTEN.sub(b"", content)).hexdigest() for name, content in contents.items()}


def changed(folder: Path, before: str, after: str) -> None:
    """Change the project's file."""
    path = folder / "project.toml"
    text = path.read_text(encoding="utf-8")
    assert before in text
    path.write_text(text.replace(before, after), encoding="utf-8")
