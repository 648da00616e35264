"""``rig view``: a past run on the page."""

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from rig.commands.options import ViewHost, ViewPort, ViewToken, warn


def view(
    run: Annotated[Path, typer.Argument(help="A run directory.", show_default=False)],
    view_port: ViewPort = None,
    view_host: ViewHost = None,
    view_token: ViewToken = None,
) -> None:
    """Play a past run on the page that `rig run --view` serves; Ctrl-C ends it."""
    from drivers.clock import WallClock
    from drivers.errors import ConfigError
    from rig.page.address import page_address
    from rig.recorded.read import read_run

    address = page_address(view_host, view_port, view_token)
    record = read_run(run)
    if find_spec("viser") is None:
        raise ConfigError("the page needs the package viser: pip install 'activerig[view]'")
    from rig.page.recorded import Player
    from rig.page.server import PageServer

    try:
        server = PageServer(address)
    except OSError as error:
        raise ConfigError(f"the page cannot be served at {address.host}: {error}") from error
    warn(f"{run} at {server.url}; Ctrl-C ends it")
    try:
        Player(server.viser, record).run(WallClock())
    except KeyboardInterrupt:
        server.stop()
