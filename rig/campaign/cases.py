"""Which runs a comparison consists of."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal, get_args

from rig.config import TargetKind

EstimatorKind = Literal[
    "observer", "kalman", "batch", "triangulation", "limb_plane", "limb_plane_ekf"
]
PolicyKind = Literal["constant", "paper", "information", "circle", "servo"]
NoiseKind = Literal["clean", "hard", "laggy", "lossy"]
StartKind = Literal["default", "axial", "along", "near", "far"]

# What each condition lays over the rig, whether images are drawn or not.
CONDITIONS: dict[NoiseKind, tuple[str, ...]] = {
    "clean": (),
    "hard": (
        "sim.features.noise_px=0.02",
        "sim.camera.noise_grey=5",
        "sim.camera.exposure_s=0.02",
        "sim.light.ambient=0.5",
        "sim.background.high_grey=70",
    ),
    "laggy": (
        "sim.camera.latency_s=0.12",
        "sim.camera.latency_jitter_s=0.02",
        "sim.arm.slide_lag_s=0.06",
        "sim.arm.wrist_lag_s=0.05",
    ),
    "lossy": ("sim.camera.drop_probability=0.3", "sim.features.lost_probability=0.1"),
}

# From where and which way the camera first goes: as the rig file has it, along the optical axis,
# along the cylinder's axis (which tells nothing), or from another distance.
STARTS: dict[TargetKind, dict[StartKind, tuple[str, ...]]] = {
    "sphere": {
        "default": (),
        "axial": ("motion.velocity_m_s=[0, 0, 0.05]",),
        "near": ("sim.sphere.start.distance_m=0.14",),
        "far": ("sim.sphere.start.distance_m=0.6",),
    },
    "cylinder": {
        "default": (),
        "axial": ("motion.velocity_m_s=[0, 0, 0.0714]",),
        "along": ("motion.velocity_m_s=[0.0357, 0.0618, 0]",),
        "near": ("sim.cylinder.start.distance_m=0.25",),
        "far": ("sim.cylinder.start.distance_m=0.9",),
    },
}


@dataclass(frozen=True, slots=True, order=True)
class Case:
    """One run."""

    target: TargetKind
    start: StartKind
    noise: NoiseKind
    policy: PolicyKind
    estimator: EstimatorKind
    seed: int

    @property
    def assignments(self) -> list[str]:
        """What is laid over the configuration."""
        return [
            *STARTS[self.target][self.start],
            *CONDITIONS[self.noise],
            f"motion.policy={self.policy}",
            f"estimator.kind={self.estimator}",
            f"sim.seed={self.seed}",
        ]


def cases_of(
    target: TargetKind,
    estimators: Sequence[EstimatorKind],
    policies: Sequence[PolicyKind],
    noises: Sequence[NoiseKind],
    seeds: int,
    starts: Sequence[StartKind] = ("default",),
) -> list[Case]:
    """All combinations that go together: moving for information needs the filter.

    Raises ValueError for a start that the target does not have.
    """
    for start in starts:
        if start not in STARTS[target]:
            known = ", ".join(STARTS[target])
            raise ValueError(f"--starts {start}: a {target} has {known}")
    return [
        Case(target, start, noise, policy, estimator, seed)
        for start, noise, policy, estimator, seed in product(
            starts, noises, policies, estimators, range(seeds)
        )
        if policy != "information" or estimator == "kalman"
    ]


def chosen(text: str, kinds: object, option: str) -> list[str]:
    """The names in a comma-separated list; raises ValueError for one that is none of ``kinds``."""
    known = get_args(kinds)
    names = [name.strip() for name in text.split(",") if name.strip()]
    wrong = [name for name in names if name not in known]
    if wrong or not names:
        raise ValueError(f"{option} {text!r}: choose from {', '.join(known)}, separated by commas")
    return list(dict.fromkeys(names))
