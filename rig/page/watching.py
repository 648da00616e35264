"""A run with or without a live page: what it shows itself to, and what may stop it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from drivers.clock import WallClock
from rig.config_safety import SafetyConfig
from rig.live import View, Views
from rig.page.address import PageAddress
from rig.page.live import LivePage

Stop = Callable[[], bool]


class Watching:
    """The page, if there is one, beside a view and a stop request."""

    def __init__(self, page: LivePage | None) -> None:
        self._page = page

    @property
    def url(self) -> str | None:
        """What to open; None without a page."""
        return None if self._page is None else self._page.url

    def beside(self, view: View) -> View:
        """``view`` and the page."""
        return view if self._page is None else Views(view, self._page)

    def or_else(self, stop_requested: Stop) -> Stop:
        """Whether ``stop_requested``, or somebody pressed STOP on the page."""
        page = self._page
        return stop_requested if page is None else lambda: stop_requested() or page.stop_requested()


@contextmanager
def watching(address: PageAddress | None, safety: SafetyConfig) -> Iterator[Watching]:
    """Serve a page for the duration of a ``with`` block; none without an address.

    Raises ConfigError or ConnectError when it cannot be served.
    """
    if address is None:
        yield Watching(None)
        return
    page = LivePage(address, safety, WallClock())
    try:
        yield Watching(page)
    finally:
        page.close()
