"""Standard output and error: closed ones, characters that a terminal cannot show, readers that have left."""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from typing_extensions import Buffer

LEFT = 141  # exit status where the reader of the output went away, as of programs that SIGPIPE ends


class _Outlet(io.FileIO):
    """A standard stream; where its reader has left, the program ends quietly and tidies up.

    Python ignores SIGPIPE, and so a client or browser that leaves its socket is an error to whoever wrote there, and
    no server ends of it.
    """

    def write(self, data: Buffer, /) -> int:
        try:
            return super().write(data)
        except OSError as error:
            with Path(os.devnull).open("wb") as nowhere:
                os.dup2(nowhere.fileno(), self.fileno())  # where all goes that is still to be written
            if isinstance(error, BrokenPipeError):
                raise SystemExit(LEFT) from None
            raise


def usable(stream: TextIO | None) -> TextIO:
    """Return a stream for standard output or error; one to nowhere where the caller has closed it."""
    if stream is None:
        return Path(os.devnull).open("w", encoding="utf-8")  # stays open as long as the program runs
    if sys.platform == "win32":  # whose terminals are no files
        stream.reconfigure(errors="replace")  # type: ignore[attr-defined]
        return stream
    outlet = io.BufferedWriter(_Outlet(stream.fileno(), "wb", closefd=False))
    return io.TextIOWrapper(outlet, stream.encoding, errors="replace", line_buffering=bool(stream.line_buffering))
