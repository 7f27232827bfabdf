"""The head of an HTTP request, read so strictly that nothing behind the gate can read it in another way."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

_LINE = re.compile(r"([A-Z]{1,16}) (/[!-~]{0,2047}) HTTP/1\.1")
_FIELD = re.compile(r"([!#$%&'*+.^_`|~0-9A-Za-z-]{1,64}):[ \t]*([ -~]*?)[ \t]*")
_TWICE = frozenset({"accept", "accept-encoding", "accept-language", "cache-control", "sec-websocket-protocol"})
_BODY = ("content-length", "transfer-encoding", "expect")
_FORWARDED = ("Accept-Encoding", "User-Agent")
_UPGRADE = ("Sec-WebSocket-Key", "Sec-WebSocket-Version", "Sec-WebSocket-Protocol")
_REASONS = {
    200: "OK", 400: "Bad Request", 401: "Unauthorized", 403: "Forbidden", 404: "Not Found", 405: "Method Not Allowed",
    408: "Request Timeout", 431: "Request Header Fields Too Large", 502: "Bad Gateway", 503: "Service Unavailable",
}  # fmt: skip


class Answer(NamedTuple):
    """What the gate itself answers.

    status : of HTTP
    text : one line of plain text, or a page
    headers : beside those of every answer
    """

    status: int
    text: str
    headers: tuple[tuple[str, str], ...] = ()

    def encoded(self) -> bytes:
        """Return the bytes of it; the connection ends with them."""
        body = self.text.encode()
        own = {
            "Content-Type": "text/plain; charset=utf-8",
            "Content-Length": str(len(body)),
            "Cache-Control": "no-store",
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Content-Security-Policy": "default-src 'none'; frame-ancestors 'none'",
            "Connection": "close",
        }
        lines = [f"HTTP/1.1 {self.status} {_REASONS[self.status]}"]
        lines += [f"{name}: {value}" for name, value in (own | dict(self.headers)).items()]
        return "\r\n".join([*lines, "", ""]).encode("ascii") + body


@dataclass(frozen=True, slots=True, kw_only=True)
class RequestHead:
    """A request without a body.

    path, query : of its address, as written
    fields : by name in small letters, each once
    """

    path: str
    query: str
    fields: Mapping[str, str]

    @property
    def is_upgrade(self) -> bool:
        """Whether it asks for a WebSocket."""
        return "upgrade" in self.fields

    def forwarded(self) -> bytes:
        """Return the head that is handed on: written anew, with the few fields that the page needs."""
        names = _FORWARDED + (_UPGRADE if self.is_upgrade else ())
        lines = [f"GET {self.path} HTTP/1.1", f"Host: {self.fields['host']}"]
        lines += ["Upgrade: websocket", "Connection: Upgrade"] if self.is_upgrade else ["Connection: close"]
        lines += [f"{name}: {self.fields[name.lower()]}" for name in names if name.lower() in self.fields]
        return "\r\n".join([*lines, "", ""]).encode("ascii")


def read_head(data: bytes) -> RequestHead | Answer:
    """Return a request's head, or the answer to one that is none: one way to read it, or none at all.

    Parameters
    ----------
    data : up to and with the empty line
    """
    try:
        first, *rest = data.decode("ascii").removesuffix("\r\n\r\n").split("\r\n")
    except UnicodeDecodeError:
        return Answer(400, "Not a request: letters that no request has.\n")
    line = _LINE.fullmatch(first)
    if line is None:
        return Answer(400, "Not a request of HTTP/1.1.\n")
    if line[1] != "GET":
        return Answer(405, "The page can be fetched, and nothing else.\n", (("Allow", "GET"),))
    fields = _fields(rest)
    if fields is None or "host" not in fields or any(name in fields for name in _BODY):
        return Answer(400, "Not a request: its header fields are malformed, said twice, or announce a body.\n")
    if "upgrade" in fields and not _is_websocket(fields):
        return Answer(400, "The connection can become a WebSocket, and nothing else.\n")
    path, _, query = line[2].partition("?")
    return RequestHead(path=path, query=query, fields=fields)


def _fields(lines: list[str]) -> dict[str, str] | None:
    fields: dict[str, str] = {}
    for text in lines:
        found = _FIELD.fullmatch(text)
        if found is None:
            return None
        name, value = found[1].lower(), found[2]
        if name in fields and name not in _TWICE:
            return None
        fields[name] = f"{fields[name]}, {value}" if name in fields else value
    return fields


def _is_websocket(fields: Mapping[str, str]) -> bool:
    connection = {part.strip().lower() for part in fields.get("connection", "").split(",")}
    return fields["upgrade"].lower() == "websocket" and "upgrade" in connection
