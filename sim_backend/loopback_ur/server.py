"""The controller on its sockets in real time: one thread, one select loop, 500 cycles a second.

A cycle that comes late is made up for, each with its own time stamp, as if the network had
delayed it: the arm's motion stays on its 2 ms grid whatever the host does.
"""

import contextlib
import select
import socket

import numpy as np

from drivers.clock import Clock, WallClock
from drivers.ur.rtde_codec import RtdeError, Value
from sim_backend.history import JointHistory
from sim_backend.loopback_ur.config import ControllerConfig
from sim_backend.loopback_ur.connection import Connection, LineSession, ScriptSession, Session
from sim_backend.loopback_ur.control_port import ControlPort
from sim_backend.loopback_ur.controller import Controller
from sim_backend.loopback_ur.dashboard import BANNER, Dashboard
from sim_backend.loopback_ur.faults import Faults
from sim_backend.loopback_ur.motion import STEP_S
from sim_backend.loopback_ur.rtde_session import Level, RtdeSession
from sim_backend.loopback_ur.truth import ArmTruth

RTDE_PORT, SCRIPT_PORT, DASHBOARD_PORT = 30004, 30003, 29999
# Not a port of the real controller: faults and ground truth.
CONTROL_PORT = 29990
# Later than this, what waits on the sockets is read before the missed cycles are made up for.
_LATE_CYCLES = 4
_MOST_CLIENTS = 100
# A host that slept longer than this does not get all its missed cycles at once.
_MOST_LATE_CYCLES = 250


class LoopbackServer:
    """A listening controller; ``serve`` runs it, ``stop`` (from any thread) ends it."""

    def __init__(
        self, host: str, config: ControllerConfig, clock: Clock | None = None, seed: int = 0
    ) -> None:
        self.host = host
        self._clock = WallClock() if clock is None else clock
        self.controller = Controller(config, seed)
        self.faults = Faults(self.controller)
        self._owners: dict[str, RtdeSession] = {}
        self._listeners: dict[int, socket.socket] = {}
        self._clients: dict[int, Connection] = {}  # by file number
        self._stopping = False
        try:
            for port in (RTDE_PORT, SCRIPT_PORT, DASHBOARD_PORT, CONTROL_PORT):
                self._listeners[port] = _listen(host, port)
        except OSError:
            self.close()
            raise
        self._start_s = self._clock.now_s()
        motion = self.controller.motion
        history = JointHistory(self._start_s, STEP_S)
        self.truth = ArmTruth(history, motion.T_flange_tool, self._clock)
        self.truth.history.append(motion.q, motion.qd)

    def serve(self, until_s: float = float("inf")) -> None:
        """Run until ``stop`` or the instant ``until_s``, then close every socket."""
        try:
            while not self._stopping and (now_s := self._clock.now_s()) < until_s:
                self._run_cycles(now_s)
                next_s = self._start_s + (self.controller.cycle + 1) * STEP_S
                self._wait(max(0.0, next_s - self._clock.now_s()))
        finally:
            self.close()

    def stop(self) -> None:
        """Make ``serve`` return after its present cycle."""
        self._stopping = True

    def close(self) -> None:
        """Close every socket; harmless when repeated."""
        for client in list(self._clients.values()):
            self._drop(client)
        for listener in self._listeners.values():
            listener.close()

    def _run_cycles(self, now_s: float) -> None:
        wanted = int((now_s - self._start_s) / STEP_S + 1e-6)
        if wanted - self.controller.cycle > _LATE_CYCLES:
            self.controller.owed_cycles = wanted - self.controller.cycle
            self._wait(0.0)
            self.controller.owed_cycles = 0
        if wanted - self.controller.cycle > _MOST_LATE_CYCLES:
            # Time stood still for the arm: shift the grid, which the history records as a rest.
            self._fill_history(wanted - self.controller.cycle - 1)
        while self.controller.cycle < wanted:
            self.controller.step()
            self.faults.step()
            motion = self.controller.motion
            self.truth.history.append(motion.q, motion.qd)
            self._send_data()

    def _fill_history(self, cycles: int) -> None:
        for _ in range(cycles):
            self.truth.history.append(self.controller.motion.q, np.zeros(6))
        self.controller.cycle += cycles

    def _send_data(self) -> None:
        if self.faults.take_drop():
            for client in list(self._clients.values()):
                if client.port != CONTROL_PORT:
                    self._drop(client)
        if self.faults.stalled:
            return
        texts = self.controller.take_texts()
        outputs: dict[str, Value] | None = None
        for client in list(self._clients.values()):
            session = client.session
            if not isinstance(session, RtdeSession) or not session.started:
                continue
            out = b"".join(session.text_frame(text, Level.ERROR) for text in texts)
            if session.due:
                outputs = self.controller.outputs() if outputs is None else outputs
                out += session.data_frame(outputs)
            self._send(client, out)

    def _wait(self, timeout_s: float) -> None:
        ports = {listener.fileno(): port for port, listener in self._listeners.items()}
        readable, _, _ = select.select([*ports, *self._clients], [], [], timeout_s)
        for number in readable:
            if number in ports:
                self._accept(ports[number])
            elif number in self._clients:
                self._receive(self._clients[number])

    def _accept(self, port: int) -> None:
        try:
            accepted, _ = self._listeners[port].accept()
        except OSError:
            return  # the client left again
        refused = self.faults.refusing and port != CONTROL_PORT
        if refused or len(self._clients) >= _MOST_CLIENTS:
            accepted.close()
            return
        client = Connection(accepted, port, self._session(port))
        self._clients[client.number] = client
        if port == DASHBOARD_PORT:
            self._send(client, (BANNER + "\n").encode())

    def _session(self, port: int) -> Session:
        if port == RTDE_PORT:
            return RtdeSession(self.controller, self._owners)
        if port == SCRIPT_PORT:
            return ScriptSession(self.controller)
        if port == DASHBOARD_PORT:
            return LineSession(Dashboard(self.controller).answer)
        return LineSession(ControlPort(self.controller, self.faults, self.truth).answer)

    def _receive(self, client: Connection) -> None:
        try:
            data = client.socket.recv(65536)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._drop(client)
            return
        try:
            reply = client.session.feed(data)
        except RtdeError:
            self._drop(client)  # assumed: a controller hangs up on what is not its protocol
            return
        if not self.faults.stalled or client.port == CONTROL_PORT:
            self._send(client, reply)

    def _send(self, client: Connection, data: bytes) -> None:
        if not data:
            return
        try:
            client.send(data)
        except OSError:
            self._drop(client)

    def _drop(self, client: Connection) -> None:
        self._clients.pop(client.number, None)
        client.close()


def _listen(host: str, port: int) -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    with contextlib.suppress(OSError):
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen(8)
        listener.setblocking(False)
    except OSError as error:
        listener.close()
        raise OSError(f"cannot listen on {host}:{port}: {error}") from error
    return listener
