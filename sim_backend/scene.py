"""What stands in front of the camera, as plain data in base coordinates."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.special import ndtr

from sim_backend.board import Board, build_board
from sim_backend.config import BackgroundConfig, SimConfig
from sim_backend.config_section import Vec3

FloatArray = NDArray[np.float64]
TargetKind = Literal["sphere", "cylinder"]
SceneKind = Literal["sphere", "cylinder", "board"]

_TEXTURE_SIZE = 512  # texels a side; a power of two, the texture repeats
_TEXELS_PER_CORRELATION = 4.0


@dataclass(frozen=True, slots=True)
class Sphere:
    """A sphere."""

    centre_m: FloatArray  # (3,)
    radius_m: float
    albedo_grey: float


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A circular cylinder with flat ends."""

    middle_m: FloatArray  # (3,) of the axis
    axis: FloatArray  # (3,) unit
    half_length_m: float
    radius_m: float
    albedo_grey: float


@dataclass(frozen=True, slots=True)
class Floor:
    """The plane z = 0, of its own grey whatever the light; one texel is plain."""

    greys: NDArray[np.float32]  # (n, n), periodic; row along y, column along x, n = 2^k
    texel_m: float

    @property
    def mean_grey(self) -> float:
        """What a distant stretch of the floor looks like."""
        return float(self.greys.mean())


@dataclass(frozen=True, slots=True)
class Scene:
    """The target, what else can be seen, and the light."""

    target: Sphere | Cylinder | Board  # what the camera is there to look at
    solids: tuple[Sphere | Cylinder, ...]  # among them the target, unless it is a board
    board: Board | None  # the target where that is a board, and it is visible
    floor: Floor
    light: FloatArray  # (3,) unit, towards the light
    ambient: float


def middle_m(target: Sphere | Cylinder | Board) -> FloatArray:
    """The target's reference point (3,) in base."""
    return target.centre_m if isinstance(target, Sphere) else target.middle_m


def build_scene(config: SimConfig, kind: SceneKind) -> Scene:
    """The configured scene with the target that ``kind`` names and all distractors."""
    target = _target(config, kind)
    board = target if isinstance(target, Board) else None
    solids = () if isinstance(target, Board) else (target,)
    return Scene(
        target=target,
        solids=(*solids, *_distractors(config)),
        board=board if config.board.visible else None,
        floor=_floor(config.background),
        light=_unit(config.light.direction),
        ambient=config.light.ambient,
    )


def _target(config: SimConfig, kind: SceneKind) -> Sphere | Cylinder | Board:
    if kind == "board":
        return build_board(config.board)
    if kind == "sphere":
        s = config.sphere
        return Sphere(np.array(s.position_m), s.radius_m, s.albedo_grey)
    c = config.cylinder
    return Cylinder(
        np.array(c.position_m), _unit(c.direction), c.length_m / 2, c.radius_m, c.albedo_grey
    )


def _distractors(config: SimConfig) -> list[Sphere | Cylinder]:
    spheres = [
        Sphere(np.array(d.position_m), d.radius_m, d.albedo_grey) for d in config.distractor_spheres
    ]
    cylinders = [
        Cylinder(
            np.array(d.position_m), _unit(d.direction), d.length_m / 2, d.radius_m, d.albedo_grey
        )
        for d in config.distractor_cylinders
    ]
    return [*spheres, *cylinders]


def _unit(direction: Vec3) -> FloatArray:
    d = np.array(direction, dtype=float)
    return d / float(np.linalg.norm(d))


def _floor(config: BackgroundConfig) -> Floor:
    if config.kind == "plain":
        return Floor(np.full((1, 1), config.low_grey, np.float32), 1.0)
    noise = np.random.default_rng(config.seed).standard_normal((_TEXTURE_SIZE, _TEXTURE_SIZE))
    # White noise smoothed by σ has the correlation exp(−d² / 4σ²).
    smooth = gaussian_filter(noise, _TEXELS_PER_CORRELATION / np.sqrt(2.0), mode="wrap")
    share = ndtr((smooth - smooth.mean()) / smooth.std())
    greys = config.low_grey + (config.high_grey - config.low_grey) * share
    return Floor(greys.astype(np.float32), config.correlation_m / _TEXELS_PER_CORRELATION)
