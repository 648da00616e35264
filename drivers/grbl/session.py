"""A connected gantry: a core and the link it speaks over, stepped by whoever has the time."""

from dataclasses import replace

from drivers.clock import Clock
from drivers.grbl.controller import lookahead_blocks, segment_s
from drivers.grbl.core import Core
from drivers.grbl.delay import MeasuredDelay
from drivers.grbl.handshake import introduce
from drivers.grbl.link import Link
from drivers.grbl.settings import GrblSettings
from drivers.grbl.timing import GrblTiming, timing_of


class Session:
    """Sets a controller up and carries bytes between its link and its core.

    Raises ConnectError where the controller cannot be used, PortLostError where the line fails.
    """

    def __init__(self, settings: GrblSettings, clock: Clock, link: Link) -> None:
        self.clock = clock
        self._link = link
        self.controller, axes = introduce(link, clock, settings)
        duration_s = settings.segment_s or segment_s(settings.baud, len(axes))
        blocks = settings.lookahead_blocks or lookahead_blocks(duration_s)
        ahead_s = blocks * duration_s
        self.timing: GrblTiming = timing_of(self.controller, settings, duration_s, ahead_s)
        self.core = Core(settings, axes, self.controller, clock.now_s(), duration_s, ahead_s)

    def exchange(self, data: bytes) -> None:
        """Give the core what was read just now, and write what it wants to say."""
        now_s = self.clock.now_s()
        if data:
            self.core.receive(data, now_s)
        out = self.core.transmit(now_s)
        if out:
            self._link.write(out)
        found = self.core.delay.result
        if found is not None and not self.timing.command_delay_measured:
            self.adopt_delay(found)

    def step(self, wait_s: float) -> None:
        """One exchange after waiting up to ``wait_s`` for bytes."""
        self.exchange(self._link.read(wait_s))

    def run_for(self, span_s: float, wait_s: float = 0.002) -> None:
        """Step for ``span_s``."""
        end_s = self.clock.now_s() + span_s
        while self.clock.now_s() < end_s:
            self.step(wait_s)

    def adopt_delay(self, found: MeasuredDelay) -> None:
        """Use a measured command delay in place of the computed one."""
        self.timing = replace(
            self.timing,
            command_delay_s=found.delay_s,
            command_delay_std_s=found.std_s,
            command_delay_measured=True,
        )
