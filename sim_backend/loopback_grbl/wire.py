"""One direction of a serial line: bytes leave in order, each taking ten bit times."""

from collections import deque

_BITS_PER_BYTE = 10.0  # start, eight data, stop


class Wire:
    """A byte pipe at a baud rate, on the caller's clock.

    A byte put on the wire arrives when those before it have and its own bits are through:
    nothing overtakes, not even a real-time command. That is what makes writing ahead costly.
    """

    def __init__(self, baud: int) -> None:
        self._byte_s = _BITS_PER_BYTE / baud
        self._bytes: deque[tuple[float, int]] = deque()
        self._free_s = float("-inf")

    def __len__(self) -> int:
        return len(self._bytes)

    def put(self, data: bytes, t_s: float) -> None:
        """Send ``data`` from ``t_s`` on, after whatever is still being sent."""
        for byte in data:
            self._free_s = max(self._free_s, t_s) + self._byte_s
            self._bytes.append((self._free_s, byte))

    def next_byte(self, t_s: float) -> int | None:
        """The byte at the head if it has arrived by ``t_s``, left where it is."""
        if self._bytes and self._bytes[0][0] <= t_s:
            return self._bytes[0][1]
        return None

    def drop_byte(self) -> None:
        """Remove the byte at the head."""
        self._bytes.popleft()

    def take(self, t_s: float) -> bytes:
        """Every byte that has arrived by ``t_s``."""
        out = bytearray()
        while (byte := self.next_byte(t_s)) is not None:
            out.append(byte)
            self.drop_byte()
        return bytes(out)

    def clear(self) -> None:
        """Lose what is on the wire."""
        self._bytes.clear()
        self._free_s = float("-inf")
