"""A comparison on a Dask cluster: workers come and die, nothing is lost and nothing doubled."""

import json
import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from drivers.errors import ConfigError, ConnectError, OperateError
from rig.campaign.campaign import run_campaign
from rig.campaign.cases import Case, cases_of
from rig.campaign.job import Job
from rig.campaign.sources import sources_here
from rig.campaign.store import Store
from rig.campaign.worker import Row
from rig.config_load import dump_config, load_config
from tests.rig.campaign.local_cluster import HOST, local_cluster

pytest.importorskip("pyarrow", reason="the extra parquet is not installed")
pytest.importorskip("distributed", reason="the extra cluster is not installed")

from rig.campaign.cluster import ClusterWorkers, check_address

PLAIN = dump_config(load_config("sphere"))
CASES = cases_of("sphere", ["kalman"], ["constant", "circle"], ["clean"], 8)


@pytest.fixture(autouse=True)
def _patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a busy machine workers take long to start."""
    monkeypatch.setattr("rig.campaign.cluster._FIRST_WORKER_S", 150.0)


def job(case: Case) -> Job:
    return Job(case, PLAIN, ("sim.level=features", "run.duration_s=0.5"), sources_here())


def test_a_worker_killed_midway_costs_nothing(tmp_path: Path) -> None:
    store, rows = Store(tmp_path, {}), list[Row]()
    with local_cluster(2) as cluster:

        def kill_one(row: Row) -> None:
            rows.append(row)
            if len(rows) == 3:  # both are in the middle of something
                cluster.workers[0].send_signal(signal.SIGKILL)

        workers = ClusterWorkers(cluster.address)
        assert run_campaign(CASES, store, workers, job, kill_one, lambda: False)
        assert cluster.workers[0].poll() == -signal.SIGKILL
        assert cluster.workers[1].poll() is None
    assert len(rows) == len(CASES)
    kept = Store(tmp_path, {}).rows
    assert Counter((str(row["policy"]), row["seed"]) for row in kept) == Counter(
        (case.policy, case.seed) for case in CASES
    )
    assert all(row["error"] == "" and row["relative_error"] is not None for row in kept)


@pytest.mark.slow
def test_without_its_scheduler_a_campaign_ends_with_what_it_has_and_goes_on_later(
    tmp_path: Path,
) -> None:
    store, rows = Store(tmp_path, {}), list[Row]()
    with local_cluster(1) as cluster:

        def end_it(row: Row) -> None:
            rows.append(row)
            cluster.scheduler.kill()

        with pytest.raises(OperateError, match=r"gone: what is finished is kept"):
            run_campaign(CASES, store, ClusterWorkers(cluster.address), job, end_it, lambda: False)
    again = Store(tmp_path, {})
    assert 1 <= len(again.rows) == len(rows) < len(CASES)
    assert len(again.missing(CASES)) == len(CASES) - len(rows)


@pytest.mark.slow
def test_a_worker_with_other_sources_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rig.campaign.cluster.sources_here", lambda: "9.9+0")
    with local_cluster(1) as cluster, pytest.raises(OperateError, match=r"9\.9\+0: tcp://.* has "):
        ClusterWorkers(cluster.address)


def test_where_nobody_answers_it_is_said_what_to_start(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rig.campaign.cluster._CONNECT_S", 0.5)
    with pytest.raises(ConnectError, match=r"`dask scheduler`"):
        ClusterWorkers(f"tcp://{HOST}:9")


@pytest.mark.parametrize("address", ["localhost", "localhost:8786", "tcp://a", "http://a:1", ""])
def test_an_address_is_checked_before_anything_else(address: str) -> None:
    with pytest.raises(ConfigError, match="tcp://HOST:PORT"):
        check_address(address)


@pytest.mark.slow
def test_ctrl_c_takes_back_what_the_cluster_was_given(tmp_path: Path) -> None:
    from distributed import Client

    command = [
        *(sys.executable, "-c", "from rig.cli import main; main()", "compare", "--json"),
        *("--target", "sphere", "--estimators", "kalman", "--policies", "constant"),
        *("--noise", "clean", "--seeds", "500", "--out", str(tmp_path)),
    ]
    with local_cluster(2) as cluster:
        process = subprocess.Popen(
            [*command, "--scheduler", cluster.address], stdout=subprocess.PIPE
        )
        with Client(cluster.address, set_as_default=False) as watching:

            def tasks() -> int:
                return int(watching.run_on_scheduler(_tasks))

            while not tasks() and process.poll() is None:
                pass
            process.send_signal(signal.SIGINT)
            out, _ = process.communicate(timeout=120)
            assert process.returncode == 130
            for _ in range(200):
                if not tasks():
                    break
            assert not tasks()
    assert all(line["runs"] < 500 for line in json.loads(out or b"[]"))


def _tasks(dask_scheduler: object) -> int:
    return len(dask_scheduler.tasks)  # type: ignore[attr-defined]
