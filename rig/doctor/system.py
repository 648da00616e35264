"""The kernel, the rights to be on time, memory and processors."""

import contextlib
import os
import resource
from dataclasses import dataclass
from pathlib import Path

from drivers.clock import Clock
from rig.doctor.finding import Finding, Status
from rig.doctor.subject import Subject

_CAP_SYS_NICE = 23
_PRIORITY = 10  # what the process that talks to a UR arm asks for
_LEAST_MEMORY_BYTES = 1 << 30
_RT_KERNEL = {
    "debian": "sudo apt install linux-image-rt-amd64",
    "ubuntu": "sudo pro enable realtime-kernel",
}
# Each in one line, because each is to be typed.
_LIMITS = (
    'printf "%s - rtprio 20\\n%s - memlock unlimited\\n" "$USER" "$USER" | '
    "sudo tee /etc/security/limits.d/activerig.conf, then log out and in again"
)
_CONTAINER = "start the container with --ulimit rtprio=20 --ulimit memlock=-1"
_GOVERNOR = "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor"


def read_text(path: Path) -> str:
    """A small file's text; empty where it cannot be read, as on other systems."""
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""


def in_container(root: Path) -> bool:
    """Whether this runs in a container, whose limits are set from outside."""
    return (root / ".dockerenv").exists() or (root / "run/.containerenv").exists()


def kernel(subject: Subject, clock: Clock) -> Finding:
    """Which kernel, and whether it is a real-time one."""
    system = os.uname()
    flag = read_text(subject.root / "sys/kernel/realtime")
    release = read_text(subject.root / "etc/os-release")
    ids = [line.partition("=")[2].strip('"') for line in release.splitlines() if line[:3] == "ID="]
    return judge_kernel(
        system.sysname, system.release, system.version, flag == "1", ids[0] if ids else ""
    )


def judge_kernel(
    system: str, release: str, version: str, realtime_flag: bool, distribution: str
) -> Finding:
    """Any Linux will do; the advice is for loops that turn out late."""
    if system != "Linux":
        return Finding(
            "kernel",
            Status.WARN,
            f"{system} {release}: only Linux has been tried",
            "use Linux for a rig with real devices",
            {"system": system, "release": release, "preempt_rt": None},
        )
    words = [word for word in version.split() if word.startswith("PREEMPT")]
    realtime = realtime_flag or "PREEMPT_RT" in words
    model = "PREEMPT_RT" if realtime else next(iter(words), "no kernel preemption")
    install = _RT_KERNEL.get(distribution, "install your distribution's PREEMPT_RT kernel")
    return Finding(
        "kernel",
        Status.OK,
        f"Linux {release}, {model}" + ("" if realtime else " (not PREEMPT_RT)"),
        "" if realtime else f"only if a loop below is late: {install}",
        {"system": system, "release": release, "preemption": model, "preempt_rt": realtime},
    )


@dataclass(frozen=True, slots=True)
class PriorityRights:
    """What this user may do about scheduling."""

    rtprio_limit: int  # highest real-time priority the limits grant, 0: none
    cap_sys_nice: bool
    granted: bool  # asking for SCHED_RR worked
    container: bool


def realtime_priority(subject: Subject, clock: Clock) -> Finding:
    """Whether this user's processes may run with real-time priority."""
    limit, _ = resource.getrlimit(resource.RLIMIT_RTPRIO)
    capabilities = [
        line.split()[1]
        for line in read_text(subject.root / "proc/self/status").splitlines()
        if line.startswith("CapEff:")
    ]
    bits = int(capabilities[0], 16) if capabilities else 0
    rights = PriorityRights(
        rtprio_limit=99 if limit == resource.RLIM_INFINITY else limit,
        cap_sys_nice=bool(bits >> _CAP_SYS_NICE & 1),
        granted=_try_priority(),
        container=in_container(subject.root),
    )
    return judge_priority(rights)


def judge_priority(rights: PriorityRights) -> Finding:
    """Without it the rig runs, and is late whenever something else wants the processor."""
    source = "CAP_SYS_NICE" if rights.cap_sys_nice else f"rtprio limit {rights.rtprio_limit}"
    values = {
        "rtprio_limit": rights.rtprio_limit,
        "cap_sys_nice": rights.cap_sys_nice,
        "granted": rights.granted,
    }
    if rights.granted:
        return Finding(
            "realtime_priority", Status.OK, f"SCHED_RR is granted ({source})", "", values
        )
    return Finding(
        "realtime_priority",
        Status.WARN,
        f"SCHED_RR is refused ({source})",
        _CONTAINER if rights.container else _LIMITS,
        values,
    )


def _try_priority() -> bool:
    """Ask for real-time priority, and give it back."""
    before, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(_PRIORITY))
    except OSError:
        return False
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, before, parameters)
    return True


@dataclass(frozen=True, slots=True)
class MemoryFacts:
    """Memory, in bytes; None where the system does not tell."""

    available: int | None
    swap: int
    lock_limit: int | None  # None: unlimited
    container: bool


def memory(subject: Subject, clock: Clock) -> Finding:
    """Free memory, and whether pages of a running loop can be swapped out."""
    limit, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    sizes: dict[str, int] = {}
    for line in read_text(subject.root / "proc/meminfo").splitlines():
        name, _, rest = line.partition(":")
        if rest.split()[:1] and rest.split()[0].isdecimal():
            sizes[name] = int(rest.split()[0]) * 1024
    return judge_memory(
        MemoryFacts(
            available=sizes.get("MemAvailable"),
            swap=sizes.get("SwapTotal", 0),
            lock_limit=None if limit == resource.RLIM_INFINITY else limit,
            container=in_container(subject.root),
        )
    )


def judge_memory(facts: MemoryFacts) -> Finding:
    """Swap matters only where memory cannot be locked, a small memory always."""
    locks = "unlimited" if facts.lock_limit is None else f"{facts.lock_limit / 2**20:.3g} MiB"
    free = "unknown" if facts.available is None else f"{facts.available / 2**30:.1f} GiB"
    text = f"{free} free, {'swap' if facts.swap else 'no swap'}, memlock {locks}"
    values = {
        "available_bytes": facts.available,
        "swap_bytes": facts.swap,
        "memlock_bytes": facts.lock_limit,
    }
    if facts.available is not None and facts.available < _LEAST_MEMORY_BYTES:
        return Finding("memory", Status.WARN, text, "end other programs: a run needs 1 GiB", values)
    if facts.swap and facts.lock_limit is not None:
        advice = (
            f"sudo swapoff -a while the rig runs, or {_CONTAINER if facts.container else _LIMITS}"
        )
        return Finding("memory", Status.WARN, text, advice, values)
    return Finding("memory", Status.OK, text, "", values)


def processor(subject: Subject, clock: Clock) -> Finding:
    """How many processors this process may use, and whether they keep their speed."""
    cpus = subject.root / "sys/devices/system/cpu"
    governors = sorted(
        {read_text(path) for path in cpus.glob("cpu[0-9]*/cpufreq/scaling_governor")} - {""}
    )
    return judge_processor(
        len(os.sched_getaffinity(0)),
        quota(read_text(subject.root / "sys/fs/cgroup/cpu.max")),
        governors,
    )


def quota(cpu_max: str) -> float | None:
    """Processors that a control group grants, from its ``cpu.max``; None: no limit."""
    limit, _, period = cpu_max.partition(" ")
    if not (limit.isdecimal() and period.strip().isdecimal()):
        return None
    return int(limit) / int(period)


def judge_processor(count: int, granted: float | None, governors: list[str]) -> Finding:
    """One processor for control, one for vision, at a speed that does not follow the load."""
    share = "" if granted is None else f", limited to {granted:.2g} by its control group"
    named = f"governor {', '.join(governors)}" if governors else "no frequency control here"
    text = f"{count} processor{'' if count == 1 else 's'}{share}, {named}"
    values = {"processors": count, "quota": granted, "governors": ", ".join(governors) or None}
    if count < 2 or (granted is not None and granted < 2.0):
        advice = "give it two processors: control and vision each want one"
        return Finding("processor", Status.WARN, text, advice, values)
    if governors and governors != ["performance"]:
        return Finding("processor", Status.WARN, text, _GOVERNOR, values)
    return Finding("processor", Status.OK, text, "", values)
