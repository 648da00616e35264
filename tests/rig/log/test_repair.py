"""Logs cut anywhere: what was flushed is read, and repaired into a file everybody reads."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from drivers.errors import ConfigError
from rig.log.lines import lines
from rig.log.reader import open_log
from rig.log.repair import repair
from tests.rig.command_line import rig
from tests.rig.fakes import make_bench


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a run of a second."""
    run_dir = tmp_path_factory.mktemp("whole")
    make_bench(run_dir, ["run.duration_s=1.2"]).run()
    return run_dir / "log.mcap"


def positions(size: int) -> list[int]:
    """Where to cut: all around the ends of the file, and all over it."""
    rng = np.random.default_rng(4)
    return sorted(
        {*range(8, 40, 4), *range(size - 40, size, 5), *rng.integers(8, size, 25).tolist()}
    )


def official(path: Path) -> list[tuple[str, int, bytes]]:
    """All messages by the official reader, which needs the index."""
    with path.open("rb") as file:
        found = make_reader(file, validate_crcs=True).iter_messages(log_time_order=False)
        return [(channel.topic, message.log_time, message.data) for _, channel, message in found]


def test_a_log_cut_at_any_byte_is_read_and_repaired(whole: Path, tmp_path: Path) -> None:
    data, complete = whole.read_bytes(), official(whole)
    recovered = []
    for position in positions(len(data)):
        cut = tmp_path / "cut.mcap"
        cut.write_bytes(data[:position])
        assert not open_log(cut).finished
        read = len(list(open_log(cut).records()))
        done = repair(cut)
        assert done.needed
        assert done.messages == read
        assert open_log(cut).finished
        found = official(cut)
        assert found == complete[: len(found)]
        assert len(found) == done.messages
        recovered.append(len(found))
    assert recovered == sorted(recovered)
    assert recovered[0] == 0 and recovered[-1] == len(complete)
    assert len(set(recovered)) > 3


def test_what_was_logged_more_than_half_a_second_before_the_cut_is_there(
    whole: Path, tmp_path: Path
) -> None:
    """The file grows in chunks of less than that, whatever moment the writer dies in."""
    instants_s = []
    for size in range(2000, whole.stat().st_size, 2003):
        cut = tmp_path / "cut.mcap"
        cut.write_bytes(whole.read_bytes()[:size])
        instants_s.append(
            max((line["logged_ns"] for line in lines(open_log(cut))), default=0) / 1e9
        )
    assert max(np.diff(sorted({0.0, *instants_s}))) < 0.5


def test_a_damaged_chunk_costs_its_own_messages_only(whole: Path, tmp_path: Path) -> None:
    data = bytearray(whole.read_bytes())
    data[len(data) // 2] ^= 0xFF
    damaged = tmp_path / "log.mcap"
    damaged.write_bytes(data)
    log = open_log(damaged)
    read = len(list(log.records()))
    assert log.damaged_chunks == 1
    done = repair(damaged, tmp_path / "repaired.mcap")
    assert (done.messages, done.damaged_chunks) == (read, 1)
    assert 0 < read < len(official(whole))
    assert len(official(tmp_path / "repaired.mcap")) == read
    assert damaged.read_bytes() == data


def test_a_whole_log_is_left_alone(whole: Path, tmp_path: Path) -> None:
    copy = tmp_path / "log.mcap"
    shutil.copy(whole, copy)
    result = rig("log", "repair", str(tmp_path))
    assert result.exit_code == 0
    assert "nothing to repair" in result.stdout
    assert copy.read_bytes() == whole.read_bytes()


def test_repairing_keeps_the_run_s_metadata_and_files(whole: Path, tmp_path: Path) -> None:
    cut = tmp_path / "log.mcap"
    cut.write_bytes(whole.read_bytes()[:-500])
    result = rig("log", "repair", str(cut))
    assert result.exit_code == 0, result.stderr
    before, after = open_log(whole), open_log(cut)
    assert after.metadata == before.metadata
    assert after.attachments == before.attachments


def test_what_is_no_log_is_named(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("nothing of the kind")
    for path in (tmp_path / "notes.txt", tmp_path / "nowhere.mcap", tmp_path):
        with pytest.raises(ConfigError, match=path.name):
            repair(path)
    assert rig("log", "info", str(tmp_path / "notes.txt")).exit_code == 2
