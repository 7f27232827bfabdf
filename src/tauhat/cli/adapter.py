"""From a command's options as a dataclass to the signature that Typer reads: options stay data."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import MISSING, fields
from typing import Any, TypeVar, get_type_hints

Options = TypeVar("Options")


def as_command(run: Callable[[Options], None], options: type[Options]) -> Callable[..., None]:
    """Return a function with one parameter per field of `options`, which fills them in and passes them to `run`.

    Parameters
    ----------
    run : the command; its docstring is the help text
    options : frozen dataclass whose fields are annotated for Typer
    """

    def command(**given: Any) -> None:
        run(options(**given))

    hints = get_type_hints(options, include_extras=True)
    command.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [
            inspect.Parameter(
                field.name,
                inspect.Parameter.KEYWORD_ONLY,
                default=inspect.Parameter.empty if field.default is MISSING else field.default,
                annotation=hints[field.name],
            )
            for field in fields(options)  # type: ignore[arg-type]
        ]
    )
    command.__annotations__ = hints
    command.__doc__ = run.__doc__
    return command
