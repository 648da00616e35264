"""``report.png``: the panels of the paper's figures for one run, or for several together."""

from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from mpl_toolkits.mplot3d import Axes3D

from rig.report.panels import (
    draw_deviation,
    draw_image,
    draw_path,
    draw_radius,
    draw_sigma2,
    draw_speed2,
    draw_transient,
)
from rig.report.shown import Shown
from rig.report.title import title

_MARGINS = {
    "left": 0.07,
    "right": 0.985,
    "bottom": 0.06,
    "top": 0.91,
    "wspace": 0.28,
    "hspace": 0.25,
}
_PANELS: tuple[Callable[..., None], ...] = (draw_transient, draw_sigma2, draw_speed2, draw_radius)


def write_png(path: Path, runs: Sequence[Shown]) -> None:
    """Draw all panels into ``path``."""
    figure = plt.figure(figsize=(15, 9))
    figure.suptitle(title(runs))
    # Fixed margins: a layout that fits itself draws everything twice.
    grid = figure.add_gridspec(2, 3, **_MARGINS)
    for index, draw in enumerate(_PANELS):
        _draw_all(figure.add_subplot(grid[divmod(index, 3)]), draw, runs)
    path_axes = figure.add_subplot(grid[1, 1], projection="3d")
    assert isinstance(path_axes, Axes3D)
    for run in runs:
        draw_path(path_axes, run.analysis, run.name, run.colour)
    last = figure.add_subplot(grid[1, 2])
    if len(runs) == 1:
        record = runs[0].record
        found = [picture for picture in record.pictures if picture.feature is not None]
        picture = found[-1] if found else None
        draw_image(last, picture, record.setup.intrinsics, record.start_s)
    else:
        _draw_all(last, draw_deviation, runs)
    figure.savefig(path, dpi=90)
    plt.close(figure)


def _draw_all(axes: Axes, draw: Callable[..., None], runs: Sequence[Shown]) -> None:
    if len(runs) == 1:
        draw(axes, runs[0].analysis)
        return
    limits = []
    for run in runs:
        axes.set_autoscaley_on(True)  # a panel that chooses its limits chose them for one run
        draw(axes, run.analysis, run.name, run.colour)
        limits.append(axes.get_ylim())
    axes.set_ylim(np.min(limits), np.max(limits))
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))  # the truth may be the same for all
    if once:
        axes.legend(once.values(), once.keys())
