"""What benchmarks of many random cases share: their options, and how they print what the cases came to."""

from __future__ import annotations

import argparse
import json
from typing import Any


def options_parser(description: str | None, *, case: str) -> argparse.ArgumentParser:
    """The parser with --json, --count and --first; `case` is what one seed makes."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help=f"seed of the first {case}")
    return parser


def show(rows: dict[str, Any], *, as_json: bool, digits: int = 3) -> None:
    """Print what the cases came to, the parts of a row below it."""
    if as_json:
        print(json.dumps(rows))
        return
    for name, value in rows.items():
        if isinstance(value, dict):
            print(name)
            for key, part in value.items():
                print(f"  {key:58} {part if isinstance(part, int) else format(part, f'.{digits}g')}")
        else:
            print(f"{name:38} {value}")
