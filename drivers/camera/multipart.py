"""Takes apart a multipart/x-mixed-replace body: bytes in, parts out, in whatever pieces."""

from dataclasses import dataclass

from drivers.errors import OperateError

_MOST_HEADER_BYTES = 16 * 1024
_MOST_PART_BYTES = 64 * 1024 * 1024


class StreamError(OperateError):
    """The bytes are not a multipart stream."""


@dataclass(frozen=True, slots=True)
class Part:
    """One part: its header fields, names in lower case, and its body."""

    headers: dict[str, str]
    body: bytes


class MultipartParser:
    """Finds the parts by their Content-Length, or by the boundary where there is none.

    Raises StreamError on a header or a part beyond any sense, never on anything else.
    """

    def __init__(self, boundary: str) -> None:
        # Some servers write the leading dashes into the header's boundary, too.
        self._marker = b"--" + boundary.strip().strip('"').removeprefix("--").encode("latin-1")
        self._buffer = bytearray()
        self._headers: dict[str, str] | None = None
        self._searched = 0

    def feed(self, data: bytes) -> list[Part]:
        """The parts completed by ``data``, oldest first."""
        self._buffer += data
        out: list[Part] = []
        while (part := self._next()) is not None:
            out.append(part)
        return out

    def _next(self) -> Part | None:
        if self._headers is None and not self._read_headers():
            return None
        headers = self._headers or {}
        length = headers.get("content-length")
        body = self._until_marker() if length is None else self._of_length(length)
        if body is None:
            return None
        self._headers, self._searched = None, 0
        return Part(headers, body)

    def _read_headers(self) -> bool:
        start = self._buffer.find(self._marker)
        if start < 0:
            if len(self._buffer) > _MOST_HEADER_BYTES:
                raise StreamError("the stream has no part boundary where one must be")
            return False
        end = self._buffer.find(b"\r\n\r\n", start)
        if end < 0:
            if len(self._buffer) - start > _MOST_HEADER_BYTES:
                raise StreamError("a part's header does not end")
            return False
        text = bytes(self._buffer[start + len(self._marker) : end]).decode("latin-1")
        del self._buffer[: end + 4]
        fields = (line.partition(":") for line in text.split("\r\n") if ":" in line)
        self._headers = {name.strip().lower(): value.strip() for name, _, value in fields}
        return True

    def _of_length(self, text: str) -> bytes | None:
        if not (text.isascii() and text.isdecimal()) or int(text[:20]) > _MOST_PART_BYTES:
            raise StreamError(f"a part announces {text[:20]!r} bytes")
        length = int(text)
        if len(self._buffer) < length:
            return None
        body = bytes(self._buffer[:length])
        del self._buffer[:length]
        return body

    def _until_marker(self) -> bytes | None:
        end = self._buffer.find(self._marker, self._searched)
        if end < 0:
            if len(self._buffer) > _MOST_PART_BYTES:
                raise StreamError("a part does not end")
            self._searched = max(0, len(self._buffer) - len(self._marker))
            return None
        body = bytes(self._buffer[:end])
        del self._buffer[:end]
        return body.removesuffix(b"\r\n")
