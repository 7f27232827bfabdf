"""Who may talk to the server: this machine alone, or whoever knows the token; no page of another site either way.

Two attacks need no account on this machine, only a browser that runs on it. A page of another site opens a WebSocket to
a loopback port: browsers name the page in `Origin`, so an origin other than the server's own page is refused. A site
whose name is made to mean 127.0.0.1 (DNS rebinding) is of the same origin: then `Host` holds the site's name, and names
other than the server's are refused. Addresses written as numbers cannot be rebound.
"""

from __future__ import annotations

import hmac
import re
import secrets
import stat
from dataclasses import dataclass, field
from ipaddress import ip_address
from pathlib import Path
from urllib.parse import urlsplit

from tauhat.errors import LiveError
from tauhat.live.reasons import reason_of

LOOPBACK = "127.0.0.1"
_SHORTEST = 16  # [characters] of a token: 96 bits where they are of base 64
_LONGEST = 256
_TOKEN = re.compile(r"[A-Za-z0-9._~+/=-]*")  # what an HTTP header carries as it is
_HOST = re.compile(r"(\[[0-9a-fA-F:.]+\]|[A-Za-z0-9._-]+)(:[0-9]{1,5})?")


@dataclass(frozen=True, slots=True, kw_only=True)
class Access:
    """Where the server listens, and who is let in.

    host : address or name to listen at; one that other machines reach needs a token
    token : secret of at least 16 characters; asked for on every channel of the network where there is one
    origins : pages that may connect beside the server's own, as `http://name:port`
    """

    host: str = LOOPBACK
    token: str | None = field(default=None, repr=False)
    origins: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.host.strip():
            raise LiveError(
                "no address to listen at", where="host", got=repr(self.host),
                remedy=f"{LOOPBACK} for this machine alone, 0.0.0.0 for all of its addresses",
            )  # fmt: skip
        if self.token is None and not is_loopback(self.host):
            raise LiveError(
                "other machines could connect, and there is no token", where=f"host {self.host}",
                remedy="give --token-file, or listen at 127.0.0.1 and use an SSH tunnel",
            )  # fmt: skip
        if self.token is not None and not _is_token(self.token):
            raise LiveError(
                "a token that is no secret", where="token", got=f"{len(self.token)} characters",
                expected=f"{_SHORTEST} to {_LONGEST} letters, digits or ._~+/=-",
                remedy=f"for example {secrets.token_urlsafe(24)}",
            )  # fmt: skip

    @property
    def is_guarded(self) -> bool:
        """Whether a token is asked for."""
        return self.token is not None

    def admits(self, token: object) -> bool:
        """Return whether this is the token, in a time that does not tell how much of it is right; True without one."""
        if self.token is None:
            return True
        given = token.encode("utf-8", "replace") if isinstance(token, str) else b""
        return hmac.compare_digest(given, self.token.encode())

    def admits_authorization(self, header: str | None) -> bool:
        """Return whether an `Authorization` header holds the token, `Bearer TOKEN`."""
        kind, _, token = (header or "").partition(" ")
        return self.admits(token.strip() if kind.lower() == "bearer" else None)

    def knows_host(self, header: str | None) -> bool:
        """Return whether a `Host` header names this server: an address, `localhost`, or the name it listens at."""
        found = _HOST.fullmatch(header or "")
        if found is None:
            return False
        name = found[1].strip("[]").lower()
        return name in {"localhost", self.host.lower()} or _is_address(name)

    def knows_origin(self, header: str | None, host: str | None) -> bool:
        """Return whether whoever connects is no page, or one of this server or of those allowed.

        Parameters
        ----------
        header : of `Origin`; None where there is none, as programs send it
        host : of `Host`: a page of this server has it as its origin
        """
        if header is None:
            return True
        if header in self.origins:
            return True
        try:
            parts = urlsplit(header if header.isprintable() else "")
        except ValueError:
            return False  # half a bracket
        own = parts.scheme in {"http", "https"} and parts.netloc == (host or "")
        return own and self.knows_host(host)


def is_loopback(host: str) -> bool:
    """Return whether only this machine reaches what listens at this address."""
    return host == "localhost" or (_is_address(host) and ip_address(host).is_loopback)


def read_token(path: Path) -> str:
    """Return the token that a file holds on its only line.

    Raises
    ------
    LiveError
        when the file cannot be read, is no text, or others than its owner may read it.
    """
    try:
        mode = path.stat().st_mode
        if not stat.S_ISREG(mode):  # a pipe would be waited for
            raise LiveError("the token cannot be read", where=path, expected="a plain file", got="something else")
        if mode & 0o077:
            raise LiveError("others may read the token", where=path, expected="mode 0600", remedy=f"chmod 600 {path}")
        with path.open(encoding="ascii") as file:
            return file.read(_LONGEST + 3).strip()
    except (OSError, UnicodeDecodeError) as error:
        raise LiveError(
            "the token cannot be read",
            where=path,
            got="no text" if isinstance(error, UnicodeError) else reason_of(error),
        ) from error


def _is_token(text: str) -> bool:
    return _SHORTEST <= len(text) <= _LONGEST and _TOKEN.fullmatch(text) is not None


def _is_address(name: str) -> bool:
    try:
        ip_address(name)
    except ValueError:
        return False
    return True
