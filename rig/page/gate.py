"""What stands between a browser and viser, which lets in anybody who reaches its port.

viser itself listens on an address of this machine that nobody was told. The gate asks whoever
comes for the token, or, where there is none, for being on this machine: the page's own name must
be one of it, and a page of another origin may not open a connection (any site visited with a
browser could).
"""

import asyncio
import contextlib
import hmac
import ipaddress
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

_COOKIE = "rig_token"
_MOST_HEAD_BYTES = 32 * 1024
_HEAD_TIMEOUT_S = 10.0
_CHUNK_BYTES = 1 << 16


class Gate:
    """Passes on to ``inside`` (host, port) what may pass."""

    def __init__(self, inside: tuple[str, int], token: str | None) -> None:
        self._inside = inside
        self._token = token

    async def serve(self, host: str, port: int) -> asyncio.Server:
        """Begin to listen; raises OSError when the address is taken."""
        return await asyncio.start_server(self._meet, host, port, limit=_MOST_HEAD_BYTES)

    async def _meet(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            try:
                head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), _HEAD_TIMEOUT_S)
                answer = self._answer(head)
                if answer is None:
                    await self._pass(head, reader, writer)
                else:
                    writer.write(answer)
                    await writer.drain()
            except TimeoutError:
                pass  # whoever connects and says nothing is let go
        writer.close()

    def _answer(self, head: bytes) -> bytes | None:
        """What to say instead of passing it on; None: it may pass."""
        request, headers = _parsed(head)
        host = headers.get("host", "")
        if "origin" in headers and urlsplit(headers["origin"]).netloc != host:
            return _response("403 Forbidden", "This connection comes from another page.")
        if self._token is None:
            if not _names_this_machine(host):
                return _response("403 Forbidden", "This page is for its own machine only.")
            return None
        given = parse_qs(urlsplit(request).query).get("token", [""])[0]
        if self._matches(given) and "upgrade" not in headers:
            # From now on the cookie says it: the address bar and its history need not.
            cookie = f"Set-Cookie: {_COOKIE}={given}; HttpOnly; SameSite=Strict; Path=/"
            return _response("303 See Other", "", "Location: /", cookie)
        if self._matches(_cookie(headers)):
            return None
        return _response("401 Unauthorized", "Open the address with its token.")

    def _matches(self, given: str) -> bool:
        return self._token is not None and hmac.compare_digest(given.encode(), self._token.encode())

    async def _pass(
        self, head: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        inner_reader, inner_writer = await asyncio.open_connection(*self._inside)
        inner_writer.write(_one_request(head))
        asking = asyncio.create_task(_copy(reader, inner_writer))
        try:
            await _copy(inner_reader, writer)
        finally:
            asking.cancel()
            inner_writer.close()


async def _copy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Until there is no more, which is passed on as well."""
    with contextlib.suppress(OSError):
        while chunk := await reader.read(_CHUNK_BYTES):
            writer.write(chunk)
            await writer.drain()
        writer.write_eof()


def _parsed(head: bytes) -> tuple[str, dict[str, str]]:
    """The request's target and its headers, names in lower case."""
    first, *lines = head.decode("latin-1").split("\r\n")
    parts = first.split(" ")
    pairs = (line.partition(":") for line in lines if ":" in line)
    headers = {name.strip().lower(): value.strip() for name, _, value in pairs}
    return (parts[1] if len(parts) > 1 else "/"), headers


def _one_request(head: bytes) -> bytes:
    """The head such that no other request follows unseen on the same connection."""
    if "upgrade" in _parsed(head)[1]:
        return head
    lines = [line for line in head.split(b"\r\n") if not line.lower().startswith(b"connection:")]
    return b"\r\n".join([lines[0], b"Connection: close", *lines[1:]])


def _names_this_machine(host: str) -> bool:
    name = urlsplit(f"//{host}").hostname or ""
    if name == "localhost":
        return True
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return False


def _cookie(headers: dict[str, str]) -> str:
    try:
        found = SimpleCookie(headers.get("cookie", "")).get(_COOKIE)
    except CookieError:
        return ""
    return "" if found is None else found.value


def _response(status: str, text: str, *headers: str) -> bytes:
    body = text.encode()
    lines = [
        f"HTTP/1.1 {status}",
        "Content-Type: text/plain; charset=utf-8",
        f"Content-Length: {len(body)}",
        "Connection: close",
        *headers,
    ]
    return "\r\n".join([*lines, "", ""]).encode() + body
