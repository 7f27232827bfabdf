"""What goes to standard error: warnings, errors in one line each, and what is being done."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperGroup

from tauhat.errors import TauhatError, TauhatWarning

if TYPE_CHECKING:
    from rich.console import Console

FAILED = 1  # exit status of every error that is not one of usage


class ReportingGroup(TyperGroup):
    """The command group whose commands fail in one line."""

    def make_context(self, *arguments: Any, **settings: Any) -> Any:
        """Read the command line, and print help or version where they are asked for."""
        with one_line_reports():
            return super().make_context(*arguments, **settings)

    def invoke(self, ctx: typer.Context) -> Any:  # type: ignore[override]
        """Run the command chosen on the command line."""
        with one_line_reports():
            result = super().invoke(ctx)
            sys.stdout.flush()
            return result


@contextmanager
def one_line_reports() -> Iterator[None]:
    """Print each warning once and errors in one line on standard error; leave with status 1 after an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", TauhatWarning)
        warnings.showwarning = _each_once()
        try:
            yield
        except TauhatError as error:
            say("error", str(error))
            raise typer.Exit(FAILED) from error
        except MemoryError as error:
            say("error", "not enough memory; take fewer rows with --rows, or a shorter motion")
            raise typer.Exit(FAILED) from error
        except OSError as error:
            say("error", _described(error))
            raise typer.Exit(FAILED) from error


def say(kind: str, message: str) -> None:
    """Print `kind: message` as one line on standard error, coloured on a terminal."""
    from rich.text import Text

    styles = {"error": "bold red", "warning": "yellow"}
    line = Text.assemble((f"{kind}:", styles.get(kind, "bold")), " ", " ".join(message.split()))
    error_console().print(line, soft_wrap=True)


@cache
def error_console() -> Console:
    """Return the console on standard error: one for all, so that nothing overwrites the sign of work."""
    from rich.console import Console

    return Console(stderr=True, highlight=False)


@contextmanager
def working(what: str) -> Iterator[None]:
    """Show on a terminal what is being done, until it is done."""
    console = error_console()
    if not console.is_terminal:
        yield
        return
    with console.status(what):
        yield


@contextmanager
def searching(what: str, generations: int) -> Iterator[Callable[[int, float], None] | None]:
    """Show on a terminal how far a genetic search is and its best criterion; yields what to call per generation."""
    console = error_console()
    if not console.is_terminal:
        yield None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("best {task.fields[best]}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(f"searching {what}", total=generations, best="-")
        yield lambda generation, best: bar.update(task, completed=generation, best=f"{best:.3f}")


def _each_once() -> Callable[..., None]:
    seen: set[str] = set()

    def show(message: Warning | str, category: type[Warning], *_: object) -> None:
        known = issubclass(category, TauhatWarning)
        text = str(message) if known else f"{category.__name__}: {message}"
        if text not in seen:
            seen.add(text)
            say("warning", text)

    return show


def _described(error: OSError) -> str:
    reason = error.strerror or str(error) or type(error).__name__
    return f"{error.filename}: {reason}" if error.filename else reason
