"""How a machine is judged; the machines themselves are facts or folders made up here."""

import pytest

from rig.config import RigConfig
from rig.doctor.finding import Status
from rig.doctor.subject import Subject
from rig.doctor.system import (
    MemoryFacts,
    PriorityRights,
    in_container,
    judge_kernel,
    judge_memory,
    judge_priority,
    judge_processor,
    kernel,
    memory,
    processor,
    quota,
    realtime_priority,
)

GIB = 1 << 30


class NoClock:
    """These checks take no time."""

    def now_s(self) -> float:
        raise AssertionError

    def sleep_until(self, t_s: float) -> None:
        raise AssertionError


@pytest.mark.parametrize(
    ("version", "flag", "realtime"),
    [
        ("#1 SMP PREEMPT_DYNAMIC Debian 6.1", False, False),
        ("#1 SMP PREEMPT_RT Debian 6.1", False, True),
        ("#1 SMP PREEMPT RT", True, True),
        ("#1 SMP", False, False),
    ],
)
def test_a_real_time_kernel_is_known_by_its_name_or_its_flag(version, flag, realtime):
    finding = judge_kernel("Linux", "6.1", version, flag, "debian")
    assert finding.values["preempt_rt"] is realtime
    assert finding.status is Status.OK, "loops that are late are told by their own rows"
    assert ("linux-image-rt" in finding.advice) is not realtime


def test_another_system_is_a_warning():
    assert judge_kernel("Darwin", "23", "", False, "").status is Status.WARN


@pytest.mark.parametrize(
    ("rights", "status", "advice"),
    [
        (PriorityRights(20, False, True, False), Status.OK, ""),
        (PriorityRights(0, True, True, False), Status.OK, ""),
        (PriorityRights(0, False, False, False), Status.WARN, "/etc/security/limits.d/"),
        (PriorityRights(0, False, False, True), Status.WARN, "--ulimit rtprio=20"),
    ],
)
def test_without_priority_the_line_to_type_fits_the_place(rights, status, advice):
    finding = judge_priority(rights)
    assert finding.status is status
    assert advice in finding.advice and bool(finding.advice) is bool(advice)


@pytest.mark.parametrize(
    ("facts", "status", "advice"),
    [
        (MemoryFacts(8 * GIB, 0, 8 << 20, False), Status.OK, ""),
        (MemoryFacts(8 * GIB, GIB, None, False), Status.OK, ""),
        (MemoryFacts(8 * GIB, GIB, 8 << 20, False), Status.WARN, "memlock unlimited"),
        (MemoryFacts(8 * GIB, GIB, 8 << 20, True), Status.WARN, "--ulimit memlock=-1"),
        (MemoryFacts(GIB // 2, 0, None, False), Status.WARN, "end other programs"),
        (MemoryFacts(None, 0, None, False), Status.OK, ""),
    ],
)
def test_swap_matters_only_where_memory_cannot_be_locked(facts, status, advice):
    finding = judge_memory(facts)
    assert finding.status is status
    assert advice in finding.advice and bool(finding.advice) is bool(advice)


@pytest.mark.parametrize(
    ("count", "granted", "governors", "status"),
    [
        (4, None, ["performance"], Status.OK),
        (2, None, [], Status.OK),
        (4, None, ["performance", "powersave"], Status.WARN),
        (1, None, [], Status.WARN),
        (8, 1.5, [], Status.WARN),
        (8, 2.0, [], Status.OK),
    ],
)
def test_two_processors_at_full_speed_are_enough(count, granted, governors, status):
    finding = judge_processor(count, granted, governors)
    assert finding.status is status
    assert bool(finding.advice) is (status is Status.WARN)


@pytest.mark.parametrize(
    ("text", "expected"), [("150000 100000", 1.5), ("max 100000", None), ("", None), ("x", None)]
)
def test_a_control_groups_share_of_the_processors(text, expected):
    assert quota(text) == expected


def test_a_container_is_known_by_the_file_its_engine_leaves(tmp_path):
    assert not in_container(tmp_path)
    (tmp_path / ".dockerenv").touch()
    assert in_container(tmp_path)


def test_facts_are_read_from_proc_and_sys(tmp_path):
    files = {
        "proc/meminfo": "MemTotal: 2048 kB\nMemAvailable:    524288 kB\nSwapTotal: 1024 kB\nBad",
        "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor": "powersave\n",
        "sys/devices/system/cpu/cpu1/cpufreq/scaling_governor": "powersave\n",
        "sys/fs/cgroup/cpu.max": "400000 100000\n",
        "sys/kernel/realtime": "1\n",
        "etc/os-release": 'NAME="Debian"\nID=debian\n',
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    subject = Subject(RigConfig(), tmp_path, root=tmp_path)
    assert memory(subject, NoClock()).values["available_bytes"] == GIB // 2
    assert memory(subject, NoClock()).values["swap_bytes"] == 1 << 20
    judged = processor(subject, NoClock())
    assert (judged.values["governors"], judged.values["quota"]) == ("powersave", 4.0)
    assert "tee /sys/devices/system/cpu" in judged.advice or judged.values["processors"] == 1
    assert kernel(subject, NoClock()).values["preempt_rt"] is True


def test_a_system_without_proc_and_sys_gives_rows_all_the_same(tmp_path):
    subject = Subject(RigConfig(), tmp_path, root=tmp_path / "nothing")
    for check in (kernel, realtime_priority, memory, processor):
        finding = check(subject, NoClock())
        assert finding.name == check.__name__
        assert finding.status is not Status.FAIL
