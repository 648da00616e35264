"""The serial gantry as an ``Arm``: a thread that keeps its core and its port talking."""

import contextlib
import os
import threading
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.errors import OperateError, RigError
from drivers.grbl import recovery
from drivers.grbl.controller import Controller
from drivers.grbl.errors import GantryError, NotReadyError
from drivers.grbl.link import Link, SerialLink
from drivers.grbl.selftest import measure_delay
from drivers.grbl.session import Session
from drivers.grbl.settings import GrblSettings
from drivers.grbl.timing import GrblTiming
from drivers.interfaces import ArmState, CommandDelay, Joints

FloatArray = NDArray[np.float64]

_LOOK_S = 0.002
_CLOSE_WAIT_S = 1.5
_JOIN_S = 1.0
_PRIORITY = 10


class GrblArm:
    """A gantry under grblHAL or plain Grbl.

    States lie half a window back (``timing.state_age_s``) and commands act late
    (``timing.command_delay_s``). There is no watchdog in the controller: should this program
    be killed, the arm runs on through what it was sent, about the command delay, and stops.

    Raises ConnectError where the port or the controller cannot be used. A controller found
    locked or held opens all the same; then ``read_states`` says so until ``recover``.
    """

    def __init__(self, settings: GrblSettings, clock: Clock) -> None:
        self._settings = settings
        self._clock = clock
        self._lock = threading.Lock()
        self._ending = threading.Event()
        self._closed = False
        self._link: Link = SerialLink(settings.port, settings.baud)
        self._session: Session | None = None
        self._thread: threading.Thread | None = None
        self._unready: NotReadyError | None = None
        try:
            self._begin()
        except NotReadyError as error:
            self._unready = error
        except BaseException:
            self._link.close()
            raise

    @property
    def timing(self) -> GrblTiming:
        """Delays, bandwidth and uncertainty of this gantry; raises as ``read_states``."""
        return self._connected().timing

    @property
    def controller(self) -> Controller:
        """What the controller said about itself, with ``notes`` on what is only assumed."""
        return self._connected().controller

    def command_delay(self) -> CommandDelay:
        """How late commands act, computed until a motion has shown it; raises as states do."""
        timing = self.timing
        return CommandDelay(
            timing.command_delay_s, timing.command_delay_std_s, timing.command_delay_measured
        )

    def remarks(self) -> tuple[str, ...]:
        """What about the controller could not be verified; raises as ``read_states``."""
        return self._connected().controller.notes

    def explain(self) -> str:
        """What the gantry's state means and what ``recover`` would do, in words."""
        with self._lock:
            failure, session = self._failure(), self._session
        status = session.core.status if session is not None else None
        if isinstance(failure, NotReadyError):
            status = failure.status
        # A state that says nothing (idle, moving) is not what went wrong.
        if failure is not None and (status is None or status.state in ("Idle", "Jog")):
            return f"{failure}. Recovering drops the interrupted motion, resets and unlocks."
        return "The gantry has not reported yet." if status is None else recovery.explain(status)

    def read_states(self) -> list[ArmState]:
        """Every state measured since the last call, oldest first.

        Raises OperateError when the gantry failed: SilentError, or a GantryError.
        """
        with self._lock:
            return self._connected().core.take_states()

    def joints(self) -> Joints | None:
        """The joints at the newest report; None before the first."""
        with self._lock:
            return self._connected().core.joints()

    def command_twist(self, twist_tool: FloatArray, hold_s: float) -> None:
        """Follow ``twist_tool`` (6,) from now on; ``hold_s`` later the jog is cancelled.

        Raises OperateError when the gantry failed, MotionError or LimitError where it cannot.
        """
        with self._lock:
            self._connected().core.command(twist_tool, hold_s, self._clock.now_s())

    def tcp_offset(self) -> None:
        """Nothing: where the tool is follows from ``settings.wrist``."""

    def stop(self) -> None:
        """Cancel the jog; returns at once, can be repeated."""
        with self._lock:
            if self._session is not None:
                self._session.core.stop()

    def recover(self, confirm: Callable[[str], bool]) -> None:
        """Explain, ask, then reset and unlock; the arm rests until a new command.

        ``confirm`` gets the explanation; nothing is unlocked unless it returns True. Opens the
        port anew if it was lost. Raises ConnectError or OperateError where that is not wanted
        or does not help.
        """
        if not confirm(self.explain()):
            raise OperateError("the gantry was left as it is: its recovery was not confirmed")
        self._restart(recovery.unlock)

    def home(self, confirm: Callable[[str], bool]) -> None:
        """Explain, ask, then run the homing cycle, which moves every axis; unlocks it too.

        Nothing moves unless ``confirm`` returns True. Raises ConnectError or OperateError where
        that is not wanted or does not succeed.
        """
        explained = f"{self.explain()} Homing drives every axis to its switch, at the controller's"
        if not confirm(f"{explained} own speeds and past this program's limits."):
            raise OperateError("the gantry was not homed: it was not confirmed, nothing moved")
        self._restart(recovery.home)

    def close(self) -> None:
        """Stop, wait for rest for up to 1.5 s, release the port."""
        if self._closed:
            return
        self._closed = True
        self.stop()
        deadline_s = self._clock.now_s() + _CLOSE_WAIT_S
        while self._stopping() and self._clock.now_s() < deadline_s:
            self._clock.sleep_until(self._clock.now_s() + _LOOK_S)
        self._end_thread()
        self._link.close()

    def _begin(self) -> None:
        session = Session(self._settings, self._clock, self._link)
        if self._settings.self_test_mm > 0.0:
            session.adopt_delay(measure_delay(session, self._settings.self_test_mm))
        self._session, self._unready = session, None
        self._ending.clear()
        self._thread = threading.Thread(
            target=self._talk, args=(session,), name="grbl", daemon=True
        )
        self._thread.start()

    def _restart(self, action: recovery.Action) -> None:
        """End the conversation, do something else over the line, begin a new conversation."""
        if self._closed:
            raise OperateError("the gantry has been closed; open it again")
        self.stop()
        self._end_thread()
        self._link.close()
        try:
            self._link = SerialLink(self._settings.port, self._settings.baud)
            action(self._link, self._clock, self._settings)
            self._begin()
        except RigError as error:
            self._link.close()
            self._fail(error)
            raise

    def _talk(self, session: Session) -> None:
        """The thread: bytes in, core, bytes out, until told to end or the line fails."""
        # Little work that must not wait; where the system does not grant it, it goes on without.
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(_PRIORITY))
        try:
            while not self._ending.is_set():
                data = self._link.read(_LOOK_S)
                with self._lock:
                    session.exchange(data)
        except RigError as error:
            self._fail(error)
        except Exception as error:  # noqa: BLE001 -- whatever it is, the caller must learn of it
            self._fail(GantryError(f"the gantry's driver failed: {error!r}; open it again"))

    def _fail(self, error: RigError) -> None:
        with self._lock:
            if self._session is not None:
                self._session.core.fail(error)

    def _end_thread(self) -> None:
        self._ending.set()
        if self._thread is not None:
            self._thread.join(timeout=_JOIN_S)

    def _stopping(self) -> bool:
        """Whether the thread is still bringing the arm to rest."""
        if self._session is None or self._thread is None or not self._thread.is_alive():
            return False
        with self._lock:
            return self._session.core.failure is None and not self._session.core.settled

    def _failure(self) -> RigError | None:
        return self._unready if self._session is None else self._session.core.failure

    def _connected(self) -> Session:
        """The session; raises what is wrong with it."""
        if self._closed:
            raise OperateError("the gantry has been closed; open it again")
        failure = self._failure()
        if failure is not None or self._session is None:
            raise failure or OperateError("the gantry is not connected; open it again")
        return self._session
