"""A ball far away on hard images: shading moves its edges by 0.3 px, which is 1 % of its size."""

import pytest

from rig.campaign.cases import Case
from rig.campaign.job import Job
from rig.campaign.sources import sources_here
from rig.campaign.worker import run_case
from rig.config_load import dump_config, load_config


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_the_radius_is_as_exact_as_is_stated(seed: int) -> None:
    case = Case("sphere", "far", "hard", "constant", "kalman", seed)
    settings = ("sim.level=pixels", "sim.renderer=raster", "run.duration_s=0.5")
    row = run_case(Job(case, dump_config(load_config("sphere")), settings, sources_here()))
    error, nees = row["relative_error"], row["nees"]
    assert isinstance(error, float) and abs(error) < 6e-3
    assert isinstance(nees, float) and nees < 9.0
