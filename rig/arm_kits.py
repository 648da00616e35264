"""The arms that ``rig arm`` knows, by name; each is imported when it is chosen."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Protocol, cast

from pydantic import BaseModel

from drivers.clock import Clock
from drivers.errors import ConfigError
from drivers.interfaces import Arm

Json = None | bool | int | float | str | list["Json"] | dict[str, "Json"]


@dataclass(frozen=True, slots=True)
class Address:
    """Where an arm is, as far as the command line said so."""

    host: str | None = None
    port: str | None = None
    baud: int | None = None
    # A rig file's arm section: axes and kinematics that its workspace is meant for.
    settings: BaseModel | None = None


class ArmKit(Protocol):
    """What can be done with one kind of arm before and beside driving it."""

    # The oldest state that is still normal for this kind of arm.
    max_state_age_s: float

    def open(self, clock: Clock) -> Arm:
        """The arm, ready to be commanded; raises ConnectError."""
        ...

    def status(self, clock: Clock) -> dict[str, Json]:
        """What the arm says about itself; ``problem`` is None when it could move."""
        ...

    def stop(self, clock: Clock) -> str:
        """Stop whatever the arm does, from outside; says what was done."""
        ...

    def recover(self, clock: Clock, confirm: Callable[[str], bool]) -> str:
        """Bring a stopped arm back after asking; says what was done. Nothing moves."""
        ...

    def home(self, clock: Clock, confirm: Callable[[str], bool]) -> str:
        """Let the arm find its zero after asking; it moves. Says what was done.

        Raises ConfigError for an arm that has no such thing.
        """
        ...


_KITS = {
    "sim": "rig.arm_sim:SimKit",
    "ur": "rig.arm_ur:UrKit",
    "grbl": "rig.arm_grbl:GrblKit",
}


def own_settings(address: Address, kind: type[BaseModel]) -> dict[str, Any]:
    """The driver's keys of the rig file, with the command line's address laid over them."""
    given = {"host": address.host, "port": address.port, "baud": address.baud}
    known = {k: v for k, v in given.items() if v is not None and k in kind.model_fields}
    if not isinstance(address.settings, kind):
        return known
    return {**address.settings.model_dump(include=set(kind.model_fields)), **known}


def arm_kit(name: str, address: Address) -> ArmKit:
    """The kit called ``name``; raises ConfigError for an unknown one or a missing address."""
    if name not in _KITS:
        raise ConfigError(f"unknown arm {name!r}; known: {', '.join(_KITS)}")
    module, _, kind = _KITS[name].partition(":")
    make = cast(Callable[[Address], ArmKit], getattr(import_module(module), kind))
    return make(address)
