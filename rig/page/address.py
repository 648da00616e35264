"""Where the page is served, and who may see it."""

import ipaddress
from dataclasses import dataclass

from drivers.errors import ConfigError

DEFAULT_PORT = 8080
_SHORTEST_TOKEN = 12


@dataclass(frozen=True, slots=True)
class PageAddress:
    """An address to listen on."""

    host: str = "127.0.0.1"
    port: int | None = None  # None: 8080, or any free one when that is taken
    token: str | None = None  # whoever opens the page has to know it; None: this machine only

    @property
    def local(self) -> bool:
        """Whether only this machine can reach it."""
        return ipaddress.ip_address(self.host).is_loopback


def page_address(host: str | None, port: int | None, token: str | None) -> PageAddress:
    """What the options ask for; raises ConfigError for an address others reach without a token."""
    host = "127.0.0.1" if host in (None, "localhost") else host
    assert host is not None
    try:
        local = ipaddress.ip_address(host).is_loopback
    except ValueError as error:
        raise ConfigError(f"--view-host {host}: give an IP address of this machine") from error
    if not local and token is None:
        raise ConfigError(
            f"--view-host {host} lets others reach the page: choose a --view-token that they have "
            "to know, or keep to 127.0.0.1 and use `ssh -L`"
        )
    if token is not None and (len(token) < _SHORTEST_TOKEN or not token.isalnum()):
        raise ConfigError(
            f"--view-token must be at least {_SHORTEST_TOKEN} letters and digits: try "
            "`openssl rand -hex 16`"
        )
    return PageAddress(host, port, token)
