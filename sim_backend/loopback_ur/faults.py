"""Faults on demand: what can go wrong with a controller, when, and for how long."""

from dataclasses import dataclass
from typing import Literal, cast, get_args

from sim_backend.loopback_ur.controller import Controller
from sim_backend.loopback_ur.motion import STEP_S

FaultKind = Literal["protective_stop", "emergency_stop", "program_stop", "drop", "stall"]


@dataclass(slots=True)
class _Pending:
    kind: FaultKind
    at_cycle: int
    cycles: int  # how long it lasts; 0: for good, where that makes sense


def fault_kind(name: str) -> FaultKind:
    """``name`` as a kind of fault; raises ValueError that lists the known ones."""
    known = get_args(FaultKind)
    if name not in known:
        raise ValueError(f"unknown fault {name!r}; known: {', '.join(known)}")
    return cast(FaultKind, name)


class Faults:
    """The faults ordered so far, applied cycle by cycle.

    ``stall`` stops all sending while connections stay open and commands are still obeyed, the
    worst kind. ``drop`` closes every connection and refuses new ones while it lasts. A released
    ``emergency_stop`` leaves the arm without power, as the real button does.
    """

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._pending: list[_Pending] = []
        self._stalled_until = 0
        self._dropped_until = 0
        self._release_at: int | None = None
        self._drop_now = False

    def order(self, kind: FaultKind, after_s: float = 0.0, for_s: float = 0.0) -> None:
        """Make ``kind`` happen ``after_s`` from now and last ``for_s`` (0: for good).

        A drop for 0 s closes the connections once and accepts new ones at once.
        """
        cycle = self._controller.cycle
        at = cycle + max(1, round(after_s / STEP_S))
        self._pending.append(_Pending(kind, at, round(for_s / STEP_S)))

    def clear(self) -> None:
        """End what lasts, release the emergency button, forget what is pending."""
        self._pending.clear()
        self._stalled_until = self._dropped_until = 0
        self._controller.release_emergency_stop()

    def step(self) -> None:
        """Apply what is due this cycle."""
        cycle = self._controller.cycle
        due = [p for p in self._pending if p.at_cycle <= cycle]
        self._pending = [p for p in self._pending if p.at_cycle > cycle]
        for pending in due:
            self._apply(pending, cycle)
        if self._release_at is not None and cycle >= self._release_at:
            self._release_at = None
            self._controller.release_emergency_stop()

    @property
    def stalled(self) -> bool:
        """Whether nothing is sent at present."""
        return self._controller.cycle < self._stalled_until

    @property
    def refusing(self) -> bool:
        """Whether new connections are closed at once at present."""
        return self._controller.cycle < self._dropped_until

    def take_drop(self) -> bool:
        """Whether all connections are to be closed now; says so once per drop."""
        drop, self._drop_now = self._drop_now, False
        return drop

    def _apply(self, pending: _Pending, cycle: int) -> None:
        lasting = cycle + (pending.cycles or 1 << 60)
        match pending.kind:
            case "protective_stop":
                self._controller.protective_stop()
            case "emergency_stop":
                self._controller.emergency_stop()
                self._release_at = lasting
            case "program_stop":
                self._controller.stop_program()
            case "stall":
                self._stalled_until = lasting
            case "drop":
                self._drop_now = True
                self._dropped_until = cycle + pending.cycles
