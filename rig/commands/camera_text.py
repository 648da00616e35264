"""What ``rig camera`` says about cameras, as text and as JSON."""

from drivers.camera.check import CameraCheck
from drivers.camera.v4l2_ioctl import OfferedMode
from drivers.camera.v4l2_nodes import VideoNode
from rig.records import Json


def modes_text(node: VideoNode, whole: bool) -> str:
    """A camera's modes: all of them, or a line per format."""
    if node.problem is not None:
        return f"cannot be asked: {node.problem}"
    if whole:
        return "\n".join(
            f"{mode.fourcc} {mode.width}x{mode.height}{' at most' if mode.stepwise else ''} @ "
            + ", ".join(f"{rate:g}" for rate in mode.rates_hz)
            for mode in node.modes
        )
    formats: dict[str, list[str]] = {}  # by what they offer: raw drivers list dozens alike
    for fourcc in dict.fromkeys(mode.fourcc for mode in node.modes):
        formats.setdefault(_offer([m for m in node.modes if m.fourcc == fourcc]), []).append(fourcc)
    return "\n".join(f"{' '.join(names)} {offer}" for offer, names in formats.items()) or "–"


def _offer(modes: list[OfferedMode]) -> str:
    largest = max(modes, key=lambda mode: mode.width * mode.height)
    fastest = max((rate for mode in modes for rate in mode.rates_hz), default=None)
    rate = "" if fastest is None else f", up to {fastest:g} fps"
    return f"up to {largest.width}x{largest.height}{rate}"


def report(result: CameraCheck) -> dict[str, Json]:
    """What ``rig camera check --json`` prints, in this order."""
    health = result.health
    return {
        "source": health.source,
        "access": health.access,
        "width": health.mode.width,
        "height": health.mode.height,
        "fourcc": health.mode.fourcc,
        "announced_fps": health.mode.rate_hz,
        "measured_fps": result.rate_hz,
        "stamp_source": health.stamp_source,
        "stamp_jitter_s": result.stamp_jitter_s,
        "latency_median_s": result.latency_median_s,
        "latency_p99_s": result.latency_p99_s,
        "exposure_s": result.exposure_s,
        "longest_gap_s": result.longest_gap_s,
        "frames": result.frames,
        "dropped": result.dropped,
        "corrupt": health.corrupt,
        "refused": health.refused,
        "reopened": health.reopened,
        "warnings": list(health.warnings),
        "problem": result.problem,
        "ok": result.problem is None and not health.warnings,
    }


def cell(name: str, value: Json) -> str:
    """One value of the report for a person."""
    if value is None:
        return "none" if name == "problem" else "unknown"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    return (
        "; ".join(str(item) for item in value) or "none" if isinstance(value, list) else str(value)
    )
