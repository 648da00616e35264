"""The web server of the page: viser on an address nobody was told, and the gate before it."""

import asyncio
import io
import random
import threading
from contextlib import AbstractContextManager, redirect_stdout

import viser

from rig.page.address import DEFAULT_PORT, PageAddress
from rig.page.gate import Gate


class PrivateServer(viser.ViserServer):
    """Viser without its tunnel to a public server, which any browser could ask for."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse."""
        return None


class PageServer:
    """Serves from construction on; raises OSError when the address is taken."""

    def __init__(self, address: PageAddress) -> None:
        # The whole of 127/8 is this machine's: an address that cannot be guessed, at a free port.
        host = f"127.{'.'.join(str(random.SystemRandom().randrange(1, 255)) for _ in range(3))}"
        with _silence():
            self.viser = PrivateServer(host=host, port=0, verbose=False)
        self._address = address
        self._gate = Gate((host, self.viser.get_port()), address.token)
        self._loop = asyncio.new_event_loop()
        threading.Thread(target=self._loop.run_forever, name="gate", daemon=True).start()
        self.port = self._listen()

    @property
    def url(self) -> str:
        """What to open."""
        host = f"[{self._address.host}]" if ":" in self._address.host else self._address.host
        if host in ("0.0.0.0", "[::]"):
            host = "<this machine>"
        token = "" if self._address.token is None else f"/?token={self._address.token}"
        return f"http://{host}:{self.port}{token}"

    def stop(self) -> None:
        """Send what is on its way and end."""
        self.viser.flush()
        with _silence():
            self.viser.stop()
        self._loop.call_soon_threadsafe(self._loop.stop)

    def _listen(self) -> int:
        wanted = self._address.port
        try:
            return self._serve(DEFAULT_PORT if wanted is None else wanted)
        except OSError:
            if wanted is not None:
                raise
            return self._serve(0)

    def _serve(self, port: int) -> int:
        serving = self._gate.serve(self._address.host, port)
        server = asyncio.run_coroutine_threadsafe(serving, self._loop).result()
        bound: int = server.sockets[0].getsockname()[1]
        return bound


def _silence() -> AbstractContextManager[object]:
    """Viser announces an address that is not for the user."""
    return redirect_stdout(io.StringIO())
