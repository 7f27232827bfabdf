"""Typed, bounded values out of a parsed TOML table; unknown keys are errors that name the key."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tauhat.errors import RobotError
from tauhat.robots.naming import advice_on_name


@dataclass(frozen=True, slots=True)
class TomlFields:
    """A table of a robot file and where it stands, for messages."""

    table: Mapping[str, Any]
    where: str

    def refuse_unknown(self, known: Iterable[str]) -> None:
        """Check that the table has no other keys than the `known` ones."""
        names = list(known)
        for key in self.table:
            if key not in names:
                raise RobotError("unknown key", where=self.where, got=key[:60], remedy=advice_on_name(key, names))

    def text(self, key: str, default: str | None = None) -> str:
        """Return a string; `default` where the key is missing (None: it must be there)."""
        value = self._value(key, default)
        if not isinstance(value, str) or not value.strip():
            raise RobotError(f"{key} is not a text", where=self.where, got=repr(value)[:60])
        return value

    def choice(self, key: str, known: tuple[str, ...], default: str | None = None) -> str:
        """Return a string that is one of the `known` ones."""
        value = self.text(key, default)
        if value not in known:
            raise RobotError(f"unknown {key}", where=self.where, expected=" | ".join(known), got=value[:60])
        return value

    def number(self, key: str, default: float | None = None) -> float:
        """Return a finite number."""
        value = self.bound(key, default)
        if not np.isfinite(value):
            raise RobotError(f"{key} is not finite", where=self.where, got=value)
        return value

    def bound(self, key: str, default: float | None = None) -> float:
        """Return a number that may be infinite, as limits may."""
        return self._as_number(key, self._value(key, default))

    def row(self, key: str, length: int, default: tuple[float, ...] | None = None) -> tuple[float, ...]:
        """Return `length` finite numbers."""
        values = self._value(key, default)
        if not isinstance(values, list | tuple) or len(values) != length:
            raise RobotError(f"{key} has the wrong form", where=self.where, expected=f"{length} numbers")
        row = tuple(self._as_number(key, value) for value in values)
        if not np.isfinite(row).all():
            raise RobotError(f"{key} is not finite", where=self.where, got=list(row))
        return row

    def subtable(self, key: str) -> TomlFields:
        """Return the table under `key`, empty where it is missing."""
        table = self.table.get(key, {})
        if not isinstance(table, dict):
            raise RobotError(f"{key} is not a table", where=self.where, expected=f"[{key}]")
        return TomlFields(table, f"{self.where}, [{key}]")

    def subtables(self, key: str) -> tuple[TomlFields, ...]:
        """Return the tables of the array `[[key]]`, numbered from one in messages."""
        tables = self.table.get(key, [])
        if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
            raise RobotError(f"{key} is not a list of tables", where=self.where, expected=f"[[{key}]]")
        return tuple(
            TomlFields(table, f"{self.where}, {key.removesuffix('s')} {n}") for n, table in enumerate(tables, start=1)
        )

    def _value(self, key: str, default: Any) -> Any:
        value = self.table.get(key, default)
        if value is None:
            raise RobotError("a key is missing", where=self.where, expected=key)
        return value

    def _as_number(self, key: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise RobotError(f"{key} is not a number", where=self.where, got=repr(value)[:60])
        try:
            number = float(value)
        except OverflowError as error:
            raise RobotError(f"{key} is far too large", where=self.where) from error
        if np.isnan(number):
            raise RobotError(f"{key} is not finite", where=self.where, got=number)
        return number
