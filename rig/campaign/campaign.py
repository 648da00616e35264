"""Hands cases out to workers and keeps what comes back."""

from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait

from drivers.clock import WallClock
from rig.campaign.cases import Case
from rig.campaign.job import Job
from rig.campaign.store import Store
from rig.campaign.worker import Row
from rig.campaign.workers import Workers

_WRITE_EVERY_S = 5.0
_LOOK_EVERY_S = 0.2
# Handed out ahead, per run at the same time: enough to keep all busy, few to wait for at a stop.
_AHEAD = 2


def run_campaign(
    cases: Sequence[Case],
    store: Store,
    workers: Workers,
    job_of: Callable[[Case], Job],
    on_row: Callable[[Row], None],
    stop_requested: Callable[[], bool],
) -> bool:
    """Run what the store lacks of ``cases``; whether all of it is done.

    What is finished is written every few seconds and at the end, however that comes. Raises
    OperateError when the workers are gone.
    """
    left = store.missing(cases)[::-1]
    clock = WallClock()
    written_s = clock.now_s()
    running: set[Future[Row]] = set()
    try:
        with workers:
            while (left or running) and not stop_requested():
                while left and len(running) < _AHEAD * workers.at_once():
                    running.add(workers.submit(job_of(left.pop())))
                if not running:  # nobody to take a job, for now
                    clock.sleep_until(clock.now_s() + _LOOK_EVERY_S)
                done, running = wait(running, _LOOK_EVERY_S, FIRST_COMPLETED)
                for future in done:
                    row = workers.row(future)
                    store.add(row)
                    on_row(row)
                if clock.now_s() - written_s >= _WRITE_EVERY_S:
                    store.write()
                    written_s = clock.now_s()
    finally:
        store.write()
    return not (left or running)
