"""Calibrate simulated rigs whose truth is hidden, and say how far off the results are.

    python -m benchmarks.bench_calibrate [--seeds 20] [--first 1] [--out DIR] [--no-runs]

Each rig differs from its drawings by up to 15 mm, 5°, 5 % of the focal length and 8 px, its
pictures are stamped 10 to 60 ms late, and every other lens is distorted. Truth and result are
compared in the unit of the stated standard deviations too.
"""

import argparse
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sim_backend import drawings

FloatArray = NDArray[np.float64]

_RIG = [sys.executable, "-c", "from rig.cli import main; main()"]
_DISTORTION = (-0.08, 0.03, 5e-4, -5e-4, 0.0)


@dataclass(frozen=True, slots=True)
class Truth:
    """A rig as it is built."""

    seed: int
    xyz_m: FloatArray  # (3,) of the camera on the tool
    turn: Rotation
    focal_px: float
    centre_px: FloatArray  # (2,)
    latency_s: float

    def settings(self) -> list[str]:
        """As options of the command line."""
        pose = [float(v) for v in (*self.xyz_m, *self.turn.as_rotvec())]
        values = {
            "sim.renderer": "raster",
            "sim.seed": self.seed,
            "sim.T_tool_camera": pose,
            "sim.camera.fx": self.focal_px,
            "sim.camera.fy": self.focal_px,
            "sim.camera.cx": self.centre_px[0],
            "sim.camera.cy": self.centre_px[1],
            "sim.camera.latency_s": self.latency_s,
            "sim.camera.stamps": "arrival",
            "sim.camera.distortion": list(_DISTORTION) if self.seed % 2 else [0.0] * 5,
        }
        return [f"--set={key}={value}" for key, value in values.items()]


def truth_of(seed: int) -> Truth:
    """The same for the same seed."""
    random = np.random.default_rng(seed)
    drawn = np.array(drawings.T_TOOL_CAMERA)
    shift, axis = (v / np.linalg.norm(v) for v in random.standard_normal((2, 3)))
    turn = np.radians(random.uniform(0.0, 5.0)) * axis
    return Truth(
        seed,
        drawn[:3] + random.uniform(0.0, 0.015) * shift,
        Rotation.from_rotvec(drawn[3:]) * Rotation.from_rotvec(turn),
        drawings.FOCAL_PX * (1.0 + random.uniform(-0.05, 0.05)),
        np.array([319.5, 239.5]) + random.uniform(-8.0, 8.0, 2),
        random.uniform(0.01, 0.06),
    )


@dataclass(frozen=True, slots=True)
class Errors:
    """Of one calibration; ``sigmas`` (10,) in stated standard deviations."""

    mm: float
    deg: float
    focal_percent: float
    centre_px: float
    latency_ms: float
    stamps_ms: float
    held_out_px: float
    sigmas: FloatArray
    wall_s: float


def errors_of(found: dict[str, dict[str, object]], truth: Truth) -> Errors:
    """What ``rig calibrate --json`` printed against the truth."""
    place = np.array(found["hand_eye"]["T_tool_camera"], dtype=float)
    place_std = np.array(found["hand_eye"]["std"], dtype=float)
    lens, lens_std = found["intrinsics"], found["intrinsics"]["std"]
    assert isinstance(lens_std, dict)
    off = place - [*truth.xyz_m, *truth.turn.as_rotvec()]
    true = {"fx": truth.focal_px, "cx": truth.centre_px[0], "cy": truth.centre_px[1]}
    lens_off = {key: float(str(lens[key])) - value for key, value in true.items()}
    late = float(str(found["latency_s"])) - truth.latency_s
    sigmas = [*(off / place_std), *(lens_off[key] / lens_std[key] for key in true)]
    turned = Rotation.from_rotvec(place[3:]).inv() * truth.turn
    return Errors(
        mm=1e3 * float(np.linalg.norm(off[:3])),
        deg=float(np.degrees(turned.magnitude())),
        focal_percent=100.0 * lens_off["fx"] / truth.focal_px,
        centre_px=max(abs(lens_off["cx"]), abs(lens_off["cy"])),
        latency_ms=1e3 * late,
        stamps_ms=1e3 * (float(str(found["stamp_late_s"])) - truth.latency_s),
        held_out_px=float(str(found["held_out_px"])),
        sigmas=np.array([*sigmas, late / float(str(found["latency_std_s"]))]),
        wall_s=float(str(found["wall_s"])),
    )


def rig(folder: Path, *arguments: str) -> dict[str, object] | None:
    """What ``rig ... --json`` prints; None, with its message on stderr, when it fails."""
    done = subprocess.run(
        [*_RIG, *arguments, "--json"], cwd=folder, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        print(done.stderr[-400:], file=sys.stderr)
        return None
    answer = json.loads(done.stdout)
    assert isinstance(answer, dict)
    return answer


def radius_error(folder: Path, truth: Truth, *options: str) -> str:
    """Of the ball, in per cent, in words where there is none."""
    run = rig(folder, "run", "--target", "sphere", *options, *truth.settings())
    error = None if run is None else run["relative_error"]
    return f"{100.0 * error:+.3f} %" if isinstance(error, float) else "none"


def one(seed: int, out: Path, runs: bool) -> Errors | None:
    """Calibrate one rig, and measure the ball with and without that."""
    truth, folder = truth_of(seed), out / f"{seed:03d}"
    folder.mkdir(parents=True, exist_ok=True)
    found = rig(folder, "calibrate", *truth.settings())
    if found is None:
        print(f"{seed:3d}  failed", flush=True)
        return None
    e = errors_of(found, truth)  # type: ignore[arg-type]
    text = (
        f"{seed:3d}  {e.mm:.3f} mm  {e.deg:.4f}°  f {e.focal_percent:+.4f} %  centre "
        f"{e.centre_px:.3f} px  latency {e.latency_ms:+.2f} ms (stamps {e.stamps_ms:+.3f})  "
        f"held out {e.held_out_px:.3f} px  largest {np.abs(e.sigmas).max():.1f} σ  "
        f"{e.wall_s:.0f} s"
    )
    if runs:
        text += f"  R {radius_error(folder, truth)}"
        text += f", uncalibrated {radius_error(folder, truth, '--uncalibrated')}"
    print(text, flush=True)
    return e


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--out", type=Path, help="kept there; default: a new temporary directory")
    parser.add_argument("--no-runs", action="store_true", help="calibrate only")
    options = parser.parse_args()
    out = options.out or Path(mkdtemp(prefix="bench-calibrate-"))
    seeds = range(options.first, options.first + options.seeds)
    done = [e for e in (one(seed, out, not options.no_runs) for seed in seeds) if e is not None]
    if not done:
        return
    sigmas = np.abs(np.concatenate([e.sigmas for e in done]))
    print(
        f"{len(done)} of {options.seeds}: at most {max(e.mm for e in done):.3f} mm, "
        f"{max(e.deg for e in done):.4f}°, f {max(abs(e.focal_percent) for e in done):.4f} %, "
        f"centre {max(e.centre_px for e in done):.3f} px, latency "
        f"{max(abs(e.latency_ms) for e in done):.2f} ms, held out "
        f"{max(e.held_out_px for e in done):.3f} px; {100.0 * np.mean(sigmas <= 3.0):.1f} % of "
        f"{sigmas.size} values within 3 σ; at most {max(e.wall_s for e in done):.0f} s"
    )


if __name__ == "__main__":
    main()
