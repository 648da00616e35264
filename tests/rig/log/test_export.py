"""``rig log info`` and ``rig log export``: the same numbers in other clothes."""

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.rig.command_line import rig
from tests.rig.fakes import Bench, make_bench


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """A run of a second that has ended."""
    bench = make_bench(tmp_path_factory.mktemp("run"), ["run.duration_s=1"])
    bench.run()
    return bench


def test_csv_holds_every_sample_to_the_bit(bench: Bench, tmp_path: Path) -> None:
    result = rig("log", "export", str(bench.run_dir), "--format", "csv", "--out", str(tmp_path))
    assert result.exit_code == 0, result.stderr
    with (tmp_path / "arm.csv").open() as file:
        rows = list(csv.DictReader(file))
    states = bench.data.arm_states
    assert len(rows) == len(states)
    for row, state in zip(rows[::50], states[::50], strict=True):
        assert float(row["t_s"]) == state.t_s
        assert [float(row[f"twist_tool_{k}"]) for k in range(6)] == state.twist_tool.tolist()
        assert float(row["T_base_tool_2_3"]) == state.T_base_tool[2, 3]
    with (tmp_path / "command.csv").open() as file:
        assert len(list(csv.DictReader(file))) == len(bench.arm.commands)


def test_parquet_holds_the_same_with_types(bench: Bench, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="the extra parquet is not installed")
    result = rig("log", "export", str(bench.run_dir), "--format", "parquet", "--out", str(tmp_path))
    assert result.exit_code == 0, result.stderr
    table = parquet.read_table(tmp_path / "update.parquet")
    chi = [update.chi for update in bench.data.updates]
    np.testing.assert_array_equal(table["chi"].to_numpy(), chi)
    assert table["axis_0"].null_count == len(chi)  # a sphere has none
    assert str(table["logged_ns"].type) == "int64"
    events = parquet.read_table(tmp_path / "event.parquet")["event"].to_pylist()
    assert events[0] == "started" and events[-1] == "ended"


def test_json_lines_hold_every_record_with_its_kind(bench: Bench, tmp_path: Path) -> None:
    result = rig("log", "export", str(bench.run_dir), "--format", "jsonl", "--out", str(tmp_path))
    assert result.exit_code == 0, result.stderr
    lines = [json.loads(line) for line in (tmp_path / "log.jsonl").read_text().splitlines()]
    assert sum(line["kind"] == "arm" for line in lines) == len(bench.data.arm_states)
    assert all(isinstance(line["logged_ns"], int) for line in lines)


def test_a_missing_package_is_named_with_what_to_type(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    out = tmp_path / "out"
    result = rig("log", "export", str(bench.run_dir), "--format", "parquet", "--out", str(out))
    assert result.exit_code == 2
    assert "activerig[parquet]" in result.stderr
    assert not out.exists()


def test_info_counts_what_is_there(bench: Bench) -> None:
    found = json.loads(rig("log", "info", str(bench.run_dir), "--json").stdout)
    assert found["finished"] and found["damaged_chunks"] == 0
    assert found["run"]["target"] == "sphere"
    assert found["channels"]["/arm/state"]["count"] == len(bench.data.arm_states)
    assert found["duration_s"] == pytest.approx(bench.clock.now_s(), abs=0.1)
    text = rig("log", "info", str(bench.run_dir)).stdout
    assert "closed in order" in text and "/camera/feature" in text


def test_the_log_of_a_killed_run_is_exported_with_a_remark(bench: Bench, tmp_path: Path) -> None:
    cut = tmp_path / "log.mcap"
    cut.write_bytes((bench.run_dir / "log.mcap").read_bytes()[:-5000])
    result = rig("log", "export", str(cut), "--format", "jsonl")
    assert result.exit_code == 0
    assert "never closed" in result.stderr
    assert (tmp_path / "export" / "log.jsonl").stat().st_size > 1000
    assert "rig log repair" in rig("log", "info", str(cut)).stdout
