"""The gate before viser: what passes, and what does not."""

import asyncio
from collections.abc import Awaitable, Callable

import pytest

from rig.page.gate import Gate

TOKEN = "0123456789abcdef"
LIMIT_S = 20.0


class Inside:
    """Stands for viser: answers with the request it got, then echoes."""

    def __init__(self) -> None:
        self.heads: list[bytes] = []

    async def meet(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.heads.append(await reader.readuntil(b"\r\n\r\n"))
        writer.write(b"HTTP/1.1 200 OK\r\n\r\ninside")
        while chunk := await reader.read(1000):
            writer.write(chunk)
        writer.close()


def talk(
    token: str | None, say: Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[bytes]]
) -> tuple[bytes, list[bytes]]:
    """What a client heard through a gate, and what got inside."""

    async def scene() -> tuple[bytes, list[bytes]]:
        inside = Inside()
        viser = await asyncio.start_server(inside.meet, "127.0.0.1", 0)
        gate = await Gate(viser.sockets[0].getsockname()[:2], token).serve("127.0.0.1", 0)
        reader, writer = await asyncio.open_connection(*gate.sockets[0].getsockname()[:2])
        heard = await asyncio.wait_for(say(reader, writer), LIMIT_S)
        writer.close()
        gate.close()
        viser.close()
        return heard, inside.heads

    return asyncio.run(scene())


def ask(token: str | None, target: str = "/", **headers: str) -> tuple[bytes, list[bytes]]:
    """One plain request: the first line of the answer and its headers, and what got inside."""
    names = {"host": "127.0.0.1:8080"} | {k.replace("_", "-"): v for k, v in headers.items()}
    lines = [f"GET {target} HTTP/1.1", *(f"{name}: {value}" for name, value in names.items())]

    async def say(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bytes:
        writer.write("\r\n".join([*lines, "", ""]).encode())
        writer.write_eof()
        return await reader.read()

    return talk(token, say)


@pytest.mark.parametrize("host", ["127.0.0.1:8080", "localhost:9000", "[::1]:8080", "127.3.2.1"])
def test_this_machine_gets_in_without_a_token(host: str) -> None:
    heard, inside = ask(None, host=host)
    assert heard.endswith(b"inside")
    assert len(inside) == 1


@pytest.mark.parametrize(
    "headers",
    [
        {"host": "evil.example"},  # a name that was made to point to this machine
        {"host": ""},
        {"origin": "http://evil.example"},  # another site's page, in a browser of this machine
        {"origin": "http://127.0.0.1:1234"},
        {"origin": "null"},
    ],
)
def test_other_names_and_other_pages_do_not(headers: dict[str, str]) -> None:
    heard, inside = ask(None, **headers)
    assert heard.startswith(b"HTTP/1.1 403")
    assert inside == []


def test_the_pages_own_connection_passes_both_ways_until_it_is_closed() -> None:
    head = (
        b"GET / HTTP/1.1\r\nhost: 127.0.0.1:8080\r\norigin: http://127.0.0.1:8080\r\n"
        b"connection: Upgrade\r\nupgrade: websocket\r\n\r\n"
    )

    async def say(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bytes:
        writer.write(head)
        heard = await reader.readuntil(b"inside")
        for word in (b"ping", b"pong"):
            writer.write(word)
            heard += await reader.readexactly(len(word))
        return heard

    heard, inside = talk(None, say)
    assert heard.endswith(b"insidepingpong")
    assert inside == [head]  # as it came: what asks to be upgraded is not changed


def test_with_a_token_nobody_gets_in_without_it() -> None:
    for target, cookie in (
        ("/", ""),
        ("/?token=", ""),
        (f"/?token={TOKEN[:-1]}", ""),
        ("/", f"rig_token={TOKEN}x"),
        ("/", "rig_token"),
        (f"/?token={TOKEN}", None),  # an upgrade cannot bring it in its address
    ):
        upgrade = {"upgrade": "websocket"} if cookie is None else {"cookie": cookie}
        heard, inside = ask(TOKEN, target, **upgrade)
        assert heard.startswith(b"HTTP/1.1 401"), (target, cookie)
        assert inside == []


def test_the_token_is_asked_for_once_and_then_kept_out_of_sight() -> None:
    heard, inside = ask(TOKEN, f"/?token={TOKEN}")
    assert heard.startswith(b"HTTP/1.1 303")
    assert f"Set-Cookie: rig_token={TOKEN}; HttpOnly; SameSite=Strict".encode() in heard
    assert b"Location: /\r\n" in heard
    assert inside == []
    heard, inside = ask(TOKEN, "/", cookie=f"other=1; rig_token={TOKEN}", host="lab.example")
    assert heard.endswith(b"inside")
    assert len(inside) == 1


def test_a_second_request_on_a_connection_does_not_slip_past() -> None:
    async def say(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bytes:
        writer.write(b"GET / HTTP/1.1\r\nhost: localhost\r\nconnection: keep-alive\r\n\r\n")
        return await reader.readuntil(b"inside")

    _, inside = talk(None, say)
    assert inside[0].lower().count(b"connection:") == 1
    assert b"Connection: close" in inside[0]
