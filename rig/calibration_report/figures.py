"""The pictures of a calibration's report, one figure each."""

from collections.abc import Sequence

import matplotlib

matplotlib.use("Agg")  # a file, on machines without a screen too

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rig.calibration.latency import LatencyFit
from rig.calibration.wiggle import WiggleResult
from rig.calibration_report.material import PoseErrors
from rig.calibration_run.fits import Geometry

FloatArray = NDArray[np.float64]

FITTED, HELD_OUT, LEFT_OUT = "#1f5fa8", "#e07b00", "#999999"
_ARROW_PX = 40.0  # that the 95th percentile of the residuals is drawn with


def coverage(errors: PoseErrors, geometry: Geometry, size: tuple[int, int]) -> Figure:
    """Where the corners were in the image, over the number in each of its parts."""
    figure, (axes, views) = plt.subplots(1, 2, figsize=(14, 5), width_ratios=(1.25, 1))
    cells = geometry.lens.coverage.cells
    shown = axes.imshow(
        cells, extent=(-0.5, size[0] - 0.5, size[1] - 0.5, -0.5), cmap="Greens", alpha=0.5, vmin=0
    )
    figure.colorbar(shown, ax=axes, label="corners in this part")
    for colour, name, numbers in _kinds(geometry, len(errors.px)):
        at = np.concatenate([errors.at_px[i] for i in numbers] or [np.zeros((0, 2))])
        axes.plot(at[:, 0], at[:, 1], ".", color=colour, markersize=3, label=name)
    axes.set(
        title=f"corner coverage: {100 * geometry.lens.coverage.share:.0f} % of the image's parts",
        xlabel="u [px]",
        ylabel="v [px]",
    )
    axes.legend(loc="upper right", fontsize=8)
    seen = geometry.lens.coverage
    views.scatter(np.degrees(seen.tilt_rad), 100 * seen.distance_m, color=FITTED, s=18)
    views.set(
        title="from where the board was seen",
        xlabel="tilt against the optical axis [°]",
        ylabel="distance [cm]",
    )
    views.set_xlim(left=0)
    views.grid(alpha=0.3)
    return _laid_out(figure)


def residuals(errors: PoseErrors, geometry: Geometry, size: tuple[int, int]) -> Figure:
    """Seen minus predicted, as arrows: of the lens by itself, and with the arm's poses."""
    figure, axes = plt.subplots(1, 3, figsize=(14, 4.4))
    lens = geometry.lens
    _arrows(axes[0], [view.pixels for view in lens.views], lens.residuals_px, size, FITTED)
    axes[0].set_title(
        f"lens alone: {lens.rms_px:.3f} px rms, held out {lens.held_out_px:.3f}", fontsize=10
    )
    _arrows(axes[1], errors.at_px, errors.off_px, size, HELD_OUT)
    joint = geometry.hand_eye
    axes[1].set_title(
        f"with the arm: {joint.fit_px:.3f} px rms, held out {joint.held_out.px:.3f}", fontsize=10
    )
    for off, colour, name in (
        (np.concatenate(errors.off_px), HELD_OUT, "with the arm's poses"),
        (np.concatenate(lens.residuals_px), FITTED, "lens alone"),
    ):
        axes[2].plot(off[:, 0], off[:, 1], ".", color=colour, markersize=3, label=name)
    axes[2].axhline(0.0, color="grey", linewidth=0.5)
    axes[2].axvline(0.0, color="grey", linewidth=0.5)
    axes[2].set(title="residuals", xlabel="Δu [px]", ylabel="Δv [px]")
    axes[2].set_aspect("equal", adjustable="datalim")
    axes[2].legend(fontsize=8)
    return _laid_out(figure)


def poses(errors: PoseErrors, geometry: Geometry) -> Figure:
    """The errors of every pose, fitted and held out."""
    figure, axes = plt.subplots(3, 1, figsize=(14, 6.5), sharex=True)
    for panel, values, label in zip(
        axes,
        (errors.px, errors.mm, errors.deg),
        ("corners [px rms]", "board's middle [mm]", "board's turn [°]"),
        strict=True,
    ):
        for colour, name, numbers in _kinds(geometry, len(errors.px)):
            panel.bar(numbers + 1, values[numbers], color=colour, label=name)
        panel.set_ylabel(label)
        panel.grid(axis="y", alpha=0.3)
    axes[0].set_title("predicted from the arm's pose, against what the image shows")
    axes[0].legend(ncols=3, fontsize=8)
    axes[-1].set_xlabel("pose")
    return _laid_out(figure)


def wiggles(results: Sequence[WiggleResult], size: tuple[int, int]) -> Figure:
    """Small motions of the tool: how the image should have moved, and how it did."""
    figure, grid = plt.subplots(2, 3, figsize=(14, 7.6))
    for axes, one in zip(grid.flat, results, strict=False):
        largest_px = float(np.linalg.norm(one.predicted_px, axis=1).max())
        stretch = max(_ARROW_PX / max(largest_px, 0.1), 1.0)
        for moved, colour, width, name in (
            (one.predicted_px, "black", 0.007, "predicted"),
            (one.observed_px, HELD_OUT, 0.0025, "observed"),
        ):
            axes.quiver(
                *one.at_px.T,
                *moved.T,
                color=colour,
                angles="xy",
                scale_units="xy",
                scale=1.0 / stretch,
                width=width,
                headwidth=3.5,
                headlength=4,
                minlength=0,
                label=name,
            )
        verdict = "" if one.passed else ": NOT as predicted"
        axes.set_title(
            f"{one.axis}: {one.motion_px:.1f} px, {one.mismatch_px:.2f} px off{verdict}"
            f" (drawn × {stretch:.0f})",
            fontsize=10,
            color="black" if one.passed else "#b00020",
        )
        _frame(axes, size)
    grid.flat[0].legend(fontsize=8)
    return _laid_out(figure)


def latency(
    fit: LatencyFit,
    correlations: Sequence[tuple[FloatArray, FloatArray]],
    offsets_s: FloatArray,
    residuals_px: Sequence[FloatArray],
) -> Figure:
    """Correlation over the lag, and the corners' residual over the offset, by segment."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(14, 4.6))
    for number, ((lags, values), rms_px, part) in enumerate(
        zip(correlations, residuals_px, fit.segments, strict=True), start=1
    ):
        name = f"segment {number}: {1e3 * part.latency_s:.2f} ± {1e3 * part.std_s:.2f} ms"
        left.plot(1e3 * lags, values, label=name)
        right.plot(1e3 * offsets_s, rms_px, label=name)
    for axes in (left, right):
        axes.axvline(1e3 * fit.latency_s, color="black", linestyle="--", linewidth=1)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
    left.set(
        title="motion in the image against the arm's",
        xlabel="stamps late by [ms]",
        ylabel="correlation",
    )
    right.set(
        title="corners against their prediction",
        xlabel="stamps late by [ms]",
        ylabel="residual [px rms]",
    )
    right.set_ylim(bottom=0)
    return _laid_out(figure)


def _kinds(geometry: Geometry, count: int) -> list[tuple[str, str, NDArray[np.intp]]]:
    """Colour, name and numbers of the fitted views, those held out and those left out."""
    fit = geometry.hand_eye
    rest = np.setdiff1d(np.arange(count), np.concatenate([fit.used, fit.held_out_views]))
    kinds = [
        (FITTED, "fitted", fit.used),
        (HELD_OUT, "held out", fit.held_out_views),
        (LEFT_OUT, "left out", rest),
    ]
    return [kind for kind in kinds if len(kind[2])]


def _arrows(
    axes: Axes,
    at_px: Sequence[FloatArray],
    off_px: Sequence[FloatArray],
    size: tuple[int, int],
    colour: str,
) -> None:
    """Residuals as arrows, all stretched alike, with a scale."""
    at, off = np.concatenate(at_px), np.concatenate(off_px)
    large_px = max(float(np.percentile(np.linalg.norm(off, axis=1), 95)), 1e-6)
    arrows = axes.quiver(
        *at.T,
        *off.T,
        color=colour,
        angles="xy",
        scale_units="xy",
        scale=large_px / _ARROW_PX,
        width=0.002,
    )
    axes.quiverkey(arrows, 0.8, -0.1, large_px, f"{large_px:.3f} px", labelpos="E")
    _frame(axes, size)


def _frame(axes: Axes, size: tuple[int, int]) -> None:
    axes.set(xlim=(-0.5, size[0] - 0.5), ylim=(size[1] - 0.5, -0.5))
    axes.set_aspect("equal")
    axes.tick_params(labelsize=7)


def _laid_out(figure: Figure) -> Figure:
    figure.tight_layout()
    return figure
