"""The panels of the paper's figures, drawn with matplotlib; several runs lie over each other."""

import matplotlib

matplotlib.use("Agg")  # a file, on machines without a screen too

import numpy as np
from matplotlib.axes import Axes
from mpl_toolkits.mplot3d import Axes3D

from estimator.image.intrinsics import Intrinsics
from estimator.image.outline import outline_px
from rig.analysis import Analysis
from rig.recorded.record import Picture

MEASURED, OBSERVER, IDEAL = "#1f5fa8", "#8a8f98", "black"
_AXIS_SHOWN_M = 0.12  # half the length drawn of a cylinder's axis


def draw_transient(
    axes: Axes, analysis: Analysis, label: str = "z", colour: str = MEASURED
) -> None:
    """The estimation error z(t) = 1/R − χ̂ with the response (5) promises, as in figs. 3a, 4, 5c.

    Another estimator than the paper's is drawn with two of its standard deviations, and with what
    the paper's would have said.
    """
    if analysis.z is None:
        axes.plot(analysis.t_s, analysis.chi, color=colour, label="χ̂" if label == "z" else label)
        axes.set(title="estimate χ̂ (true radius unknown)", xlabel="t [s]", ylabel="χ̂ [1/m]")
        return
    axes.plot(analysis.t_s, analysis.z, color=colour, label=label)
    if analysis.z_observer is not None and analysis.other_than_observer:
        axes.plot(analysis.t_s, analysis.z_observer, color=OBSERVER, label="the paper's observer")
    if analysis.chi_std is not None:
        limits = axes.get_ylim()  # the prior's band would leave no room for the rest
        low, high = analysis.z - 2.0 * analysis.chi_std, analysis.z + 2.0 * analysis.chi_std
        axes.fill_between(analysis.t_s, low, high, color=colour, alpha=0.2, linewidth=0)
        axes.set_ylim(*limits)
    if analysis.z_ideal is not None:
        axes.plot(analysis.t_s, analysis.z_ideal, "--", color=IDEAL, linewidth=1)
    axes.axhline(0.0, color="grey", linewidth=0.5)
    dashed = "" if analysis.z_ideal is None else " (dashed: ideal)"
    axes.set(title=f"estimation error z{dashed}", xlabel="t [s]", ylabel="z [1/m]")
    axes.legend()


def draw_deviation(
    axes: Axes, analysis: Analysis, label: str = "z", colour: str = MEASURED
) -> None:
    """How far the paper's observer is from the ideal response, in per cent of z(0)."""
    share = analysis.deviation
    if share is not None:
        share = 100.0 * share
        axes.plot(analysis.t_s, share, color=colour, label=label, linewidth=1)
        axes.legend()
    axes.set(title="deviation from the ideal response", xlabel="t [s]", ylabel="[% of z(0)]")


def draw_radius(axes: Axes, analysis: Analysis, label: str = "R̂", colour: str = MEASURED) -> None:
    """The estimated radius over time, with the true one and ± 1 % where it is known."""
    axes.plot(analysis.t_s, analysis.radius_m * 1e3, color=colour, label=label)
    final_mm = float(analysis.radius_m[-1]) * 1e3 if len(analysis.radius_m) else np.nan
    if analysis.radius_true_m is not None:
        true_mm = final_mm = analysis.radius_true_m * 1e3
        axes.axhline(true_mm, color=IDEAL, linewidth=1, linestyle="--", label="true")
        axes.axhspan(0.99 * true_mm, 1.01 * true_mm, color="green", alpha=0.15, label="± 1 %")
    if np.isfinite(final_mm):
        axes.set_ylim(0.4 * final_mm, 2.2 * final_mm)
    axes.set(title="radius", xlabel="t [s]", ylabel="R̂ [mm]")
    axes.legend()


def draw_sigma2(axes: Axes, analysis: Analysis, label: str = "σ₁²", colour: str = MEASURED) -> None:
    """σ1²(t) of the measured motion, as in fig. 5b."""
    axes.plot(analysis.motion_t_s, analysis.sigma2, color=colour, label=label, linewidth=1)
    axes.set(title="σ₁²", xlabel="t [s]", ylabel="σ₁² [m²/s²]")
    axes.set_ylim(bottom=0.0)
    axes.legend()


def draw_speed2(
    axes: Axes, analysis: Analysis, label: str = "‖v‖²", colour: str = MEASURED
) -> None:
    """‖v‖² of the measured camera velocity, as in fig. 5a."""
    axes.plot(analysis.motion_t_s, analysis.speed2, color=colour, label=label, linewidth=1)
    axes.set(title="‖v‖²", xlabel="t [s]", ylabel="‖v‖² [m²/s²]")
    axes.set_ylim(bottom=0.0)
    axes.legend()


def draw_path(
    axes: Axes3D, analysis: Analysis, label: str = "camera", colour: str = MEASURED
) -> None:
    """The camera's path in the base frame with arrows along its optical axis (figs. 3b, 5d)."""
    p, z = analysis.path_m, analysis.optical_axes
    if len(p) == 0:
        return
    axes.plot(p[:, 0], p[:, 1], p[:, 2], color=colour, label=label)
    some = np.linspace(0, len(p) - 1, 9).astype(int)
    length_m = 0.3 * float(np.ptp(p, axis=0).max()) + 1e-3
    axes.quiver(*p[some].T, *z[some].T, length=length_m, color=colour, linewidth=1)
    target, axis = analysis.target_m, analysis.target_axis
    if target is not None and axis is None:
        axes.scatter(*target, color="black", s=20)
    elif target is not None and axis is not None:
        ends = target + np.outer([-_AXIS_SHOWN_M, _AXIS_SHOWN_M], axis)
        axes.plot(*ends.T, color="black", linewidth=1.5)
    axes.set_aspect("equal")
    axes.locator_params(nbins=4)
    axes.tick_params(labelsize=7)
    axes.set(title="camera path, base frame", xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")


def draw_image(axes: Axes, picture: Picture | None, intrinsics: Intrinsics, start_s: float) -> None:
    """An image with the fitted outline."""
    axes.set_axis_off()
    if picture is None:
        axes.set_title("no image with an outline was recorded")
        return
    image = picture.load()
    axes.imshow(image, cmap="gray", vmin=0, vmax=255)
    lines = [] if picture.feature is None else outline_px(picture.feature, intrinsics, image.shape)
    for line in lines:
        axes.plot(line[:, 0], line[:, 1], color="#ff5533", linewidth=1.2)
    axes.set(title=f"image at t = {picture.t_s - start_s:.2f} s with the fitted outline")
    axes.set_xlim(-0.5, image.shape[1] - 0.5)
    axes.set_ylim(image.shape[0] - 0.5, -0.5)
