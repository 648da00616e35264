"""The port that takes programs: text up to the ``end`` in column 0 is one program; no reply."""

_MOST_BYTES = 1 << 20


class ScriptPort:
    """Collects one connection's bytes into programs."""

    def __init__(self) -> None:
        self._held = bytearray()

    def feed(self, data: bytes) -> list[str]:
        """The programs completed by ``data``; a megabyte without an end is thrown away."""
        self._held += data
        programs: list[str] = []
        while (at := self._held.find(b"\nend\n")) >= 0:
            programs.append(self._held[: at + 5].decode("utf-8", errors="replace"))
            del self._held[: at + 5]
        if len(self._held) > _MOST_BYTES:
            self._held.clear()
        return programs
