"""Figures of the chain's stages; each function returns a matplotlib Figure, `save` writes it atomically as SVG.

The figures keep their own white ground, so that they read the same on light and dark pages.
"""

import os
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from scipy import stats

from calibration.optimise import solution_mesh

BLUE, ORANGE, GREY, GREEN = "#2f6db5", "#d1711f", "#8a8f98", "#2e8b57"
STYLE = {
    "figure.facecolor": "white",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.prop_cycle": matplotlib.cycler(
        color=[BLUE, ORANGE, GREEN, "#7b4fa3", "#b5363f", "#5b7a1f", GREY],
        linestyle=["-", "--", "-.", ":", "-", "--", "-."],
    ),
    "grid.alpha": 0.25,
    "font.size": 10,
    "axes.titlesize": 11,
    "svg.fonttype": "none",
    "svg.hashsalt": "granular-calibration",
}
ANGLE = "angle of repose [°]"


def label(name):
    """Readable form of a factor's name."""
    return name.replace("_", " ")


def _axes(rows=1, columns=1, size=(6.4, 4.2), **more):
    with plt.rc_context(STYLE):
        return plt.subplots(rows, columns, figsize=size, layout="constrained", **more)


def save(figure, path):
    """Write a figure to `path` (.svg or .png) and close it."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".partial.{path.name}")
    with plt.rc_context(STYLE):
        metadata = {"Date": None} if path.suffix == ".svg" else None
        figure.savefig(partial, dpi=150, metadata=metadata)
    os.replace(partial, path)
    plt.close(figure)


def half_normal(table, chosen):
    """Half-normal plot of absolute effects; `chosen` codes stand out."""
    figure, ax = _axes()
    size, score = table["effect"].abs(), table["half_normal_score"]
    picked = table["code"].isin(chosen)
    ax.scatter(size[~picked], score[~picked], color=GREY, label="stays at its level")
    ax.scatter(size[picked], score[picked], color=ORANGE, label="goes on")
    for e, s, code, name in zip(size, score, table["code"], table["name"], strict=True):
        text = f"{code}  {label(name)}" if code in chosen else code
        ax.annotate(text, (e, s), xytext=(6, -3), textcoords="offset points", fontsize=9)
    small = ~picked if (~picked).any() else picked
    slope = float((score[small] * size[small]).sum() / (size[small] ** 2).sum())
    line = np.array([0.0, float(score.max()) / slope])
    ax.plot(line, slope * line, color=GREY, lw=1)
    ax.set(
        xlabel="|effect| [°]",
        ylabel="half-normal quantile",
        xlim=(0, 1.45 * size.max()),
        ylim=(0, 1.15 * score.max()),
    )
    ax.legend(loc="lower right", frameon=False)
    return figure


def pareto(table, t_limit, bonferroni_limit, alpha=0.05):
    """Pareto chart of absolute effects with the limits of significance at level alpha."""
    figure, ax = _axes()
    order = table.reindex(table["effect"].abs().sort_values().index)
    colour = np.where(order["effect"] > 0, BLUE, ORANGE)
    names = [f"{label(n)}  {c}" for n, c in zip(order["name"], order["code"], strict=True)]
    ax.barh(names, order["effect"].abs(), color=colour)
    ax.axvline(t_limit, color="black", lw=1, ls="--")
    ax.axvline(bonferroni_limit, color="black", lw=1, ls=":")
    for x, text in (
        (t_limit, f"t limit {100 * alpha:g} %"),
        (bonferroni_limit, f"Bonferroni {100 * alpha:g} %"),
    ):
        ax.annotate(
            text,
            (x, 0),
            xytext=(3, -2),
            textcoords="offset points",
            rotation=90,
            fontsize=8,
            va="bottom",
        )
    ax.set(xlabel="|effect| [°]; blue raises the angle, orange lowers it")
    return figure


def ascent_path(runs, factors, target, best):
    """Response along the path with the target."""
    figure, ax = _axes()
    ax.errorbar(
        runs["run"],
        runs["response"],
        yerr=runs.get("response_sd"),
        color=BLUE,
        marker="o",
        capsize=3,
    )
    ax.axhline(target, color=ORANGE, lw=1.2, label=f"measured {target:.2f}°")
    row = runs[runs["run"] == best].iloc[0]
    ax.scatter(
        [best],
        [row["response"]],
        s=140,
        facecolor="none",
        edgecolor=ORANGE,
        zorder=3,
        label="centre of the region",
    )
    names = ["\n".join(f"{r[f.name]:.3g}" for f in factors) for _, r in runs.iterrows()]
    ax.set_xticks(runs["run"], names)
    ax.set(
        ylabel=ANGLE,
        xlabel="\n".join(f"{i + 1}. line: {label(f.name)}" for i, f in enumerate(factors)),
    )
    ax.legend(frameon=False)
    return figure


def predicted_actual(surface):
    """Predicted against simulated response."""
    figure, ax = _axes(size=(4.8, 4.6))
    d = surface.diagnostics
    ax.scatter(d["actual"], d["predicted"], color=BLUE)
    ends = [
        min(d["actual"].min(), d["predicted"].min()),
        max(d["actual"].max(), d["predicted"].max()),
    ]
    ax.plot(ends, ends, color=GREY, lw=1)
    ax.set(xlabel="simulated [°]", ylabel="predicted by the quadratic model [°]", aspect="equal")
    return figure


def residual_panel(surface):
    """Normal plot of residuals, residuals against prediction and run, and Cook's distance."""
    d = surface.diagnostics
    figure, ax = _axes(2, 2, size=(8, 6.4))
    z = np.sort(d["externally_studentised"])
    q = stats.norm.ppf((np.arange(1, len(z) + 1) - 0.5) / len(z))
    ax[0, 0].scatter(z, q, color=BLUE)
    ax[0, 0].plot(q, q, color=GREY, lw=1)
    ax[0, 0].set(xlabel="externally studentised residual", ylabel="normal quantile")
    for panel, x, name in (
        (ax[0, 1], d["predicted"], "predicted [°]"),
        (ax[1, 0], d["run"], "run"),
    ):
        panel.scatter(x, d["externally_studentised"], color=BLUE)
        limit = stats.t.ppf(1 - 0.025 / len(d), max(surface.df - 1, 1))
        for y in (-limit, 0, limit):
            panel.axhline(y, color=GREY, lw=1, ls="-" if y == 0 else "--")
        panel.set(xlabel=name, ylabel="externally studentised residual")
    ax[1, 1].vlines(d["run"], 0, d["cooks_distance"], color=BLUE)
    ax[1, 1].axhline(1.0, color=GREY, lw=1, ls="--")
    ax[1, 1].set(xlabel="run", ylabel="Cook's distance")
    return figure


def perturbation(surface, region):
    """Response along each factor with the others at the centre."""
    figure, ax = _axes()
    x = np.linspace(-1, 1, 81)
    for k, factor in enumerate(region):
        levels = np.zeros((len(x), len(region)))
        levels[:, k] = x
        ax.plot(x, surface.predict(levels), label=f"{factor.code}  {label(factor.name)}")
    ax.set(xlabel="distance from the centre, coded", ylabel=ANGLE)
    ax.legend(frameon=False)
    return figure


def _slice(surface, region, i, j, resolution=61, at=None):
    x = np.linspace(-1, 1, resolution)
    a, b = np.meshgrid(x, x)
    levels = np.tile(np.zeros(len(region)) if at is None else at, (a.size, 1))
    levels[:, i], levels[:, j] = a.ravel(), b.ravel()
    return region[i].natural(a), region[j].natural(b), surface.predict(levels).reshape(a.shape)


def _pairs(region):
    return [(i, j) for i in range(len(region)) for j in range(i + 1, len(region))]


def _panels(count, size):
    """Figure and rows, columns of a grid of `count` panels, three a row; size: inches of one."""
    columns = min(count, 3)
    rows = -(-count // columns)
    figure = plt.figure(figsize=(size[0] * columns, size[1] * rows), layout="constrained")
    return figure, rows, columns


def _label_3d(ax, x, y, z):
    ax.set_xlabel(x, fontsize=8)
    ax.set_ylabel(y, fontsize=8)
    ax.set_zlabel(z, fontsize=8)
    ax.tick_params(labelsize=7)
    ax.set_box_aspect(None, zoom=0.85)


def surfaces(surface, region):
    """Response surfaces of all pairs of factors, the others at the centre."""
    pairs = _pairs(region)
    with plt.rc_context(STYLE):
        figure, rows, columns = _panels(len(pairs), (4.4, 4.2))
        for n, (i, j) in enumerate(pairs):
            ax = figure.add_subplot(rows, columns, n + 1, projection="3d")
            a, b, y = _slice(surface, region, i, j, 31)
            ax.plot_surface(a, b, y, cmap="viridis", alpha=0.9)
            _label_3d(ax, label(region[i].name), label(region[j].name), "angle [°]")
    return figure


def contours(surface, region, solution):
    """Contours through the chosen point with the solution set drawn in; for three factors also the set itself."""
    pairs = _pairs(region)
    whole = len(region) == 3 and solution.attainable
    with plt.rc_context(STYLE):
        if whole:
            figure, rows, columns = plt.figure(figsize=(9.6, 8.0), layout="constrained"), 2, 2
        else:
            figure, rows, columns = _panels(len(pairs), (4.8, 4.0))
        for n, (i, j) in enumerate(pairs):
            _contour(figure.add_subplot(rows, columns, n + 1), surface, region, i, j, solution)
        if whole:
            _solution_set(figure.add_subplot(2, 2, 4, projection="3d"), surface, region, solution)
    return figure


def _contour(ax, surface, region, i, j, solution):
    a, b, y = _slice(surface, region, i, j, at=solution.chosen)
    filled = ax.contourf(a, b, y, 12, cmap="viridis", alpha=0.85)
    ax.figure.colorbar(filled, ax=ax, label=ANGLE, shrink=0.9)
    if y.min() < solution.target < y.max():
        ax.contour(a, b, y, [solution.target], colors="white", linewidths=4.5)
        ax.contour(a, b, y, [solution.target], colors=ORANGE, linewidths=2.5)
    x, z = (region[k].natural(float(solution.chosen[k])) for k in (i, j))
    ax.plot(x, z, "o", color="white", mec="black", ms=9, clip_on=False, zorder=4)
    ax.set(xlabel=label(region[i].name), ylabel=label(region[j].name))
    ax.grid(False)


def _solution_set(ax, surface, region, solution):
    """The surface of all points that give the target, in natural levels."""
    vertices, triangles = solution_mesh(surface, solution.target)
    if len(triangles):
        natural = [f.natural(vertices[:, k]) for k, f in enumerate(region)]
        ax.plot_trisurf(
            natural[0], natural[1], triangles, natural[2], color=ORANGE, alpha=0.55, linewidth=0
        )
    chosen = [[f.natural(float(x))] for f, x in zip(region, solution.chosen, strict=True)]
    ax.plot(*chosen, "o", color="white", mec="black", ms=9, zorder=10)
    ax.set(**{f"{axis}lim": (f.low, f.high) for axis, f in zip("xyz", region, strict=True)})
    _label_3d(ax, *(label(f.name) for f in region))
    ax.set_title(f"all points that give {solution.target:.2f}°", fontsize=9)


def sweep(levels, response, coefficients, inverse, measured, test):
    """Sweep of a bench test with its quadratic and the inverse of the measured value."""
    figure, ax = _axes()
    x = np.linspace(min(levels), max(levels), 101)
    ax.plot(x, np.polyval(coefficients, x), color=GREY, label="quadratic fit")
    ax.scatter(levels, response, color=BLUE, zorder=3, label="simulated")
    ax.hlines(measured, min(levels), inverse, color=ORANGE, lw=1.2)
    ax.vlines(
        inverse, 0, measured, color=ORANGE, lw=1.2, label=f"measured {measured:g}: {inverse:.3f}"
    )
    ax.set(xlabel=label(test.factor), ylabel=test.axis, ylim=(0, 1.05 * max(response)))
    ax.legend(frameon=False)
    return figure


def yield_loci(runs, loci, slope, intercept):
    """Shear stress over normal stress with the fitted lines and the measured one."""
    figure, ax = _axes()
    x = np.linspace(0.0, 1.05 * runs["normal_stress_kPa"].max(), 2)
    for name, colour in (("peak", BLUE), ("steady", GREEN)):
        ax.scatter(runs["normal_stress_kPa"], runs[f"{name}_kPa"], color=colour, alpha=0.7)
        line = loci[name]
        text = f"{name}: {line['slope']:.2f} x {line['intercept_kPa']:+.2f}"
        ax.plot(x, line["slope"] * x + line["intercept_kPa"], color=colour, label=text)
    ax.plot(
        x,
        slope * x + intercept,
        color=ORANGE,
        ls="--",
        label=f"measured: {slope:g} x {intercept:+g}",
    )
    ax.set(
        xlabel="normal stress [kPa]", ylabel="shear stress [kPa]", xlim=(0, None), ylim=(0, None)
    )
    ax.legend(frameon=False)
    return figure


def validation(groups, measured, result):
    """Replicates by group beside the measurement, with means and the equivalence margin."""
    figure, ax = _axes()
    for g, values in enumerate(groups):
        ax.scatter(np.full(len(values), g + 1), values, color=BLUE, alpha=0.7)
        ax.hlines(values.mean(), g + 0.75, g + 1.25, color=BLUE, lw=2)
    place = len(groups) + 1.5
    jitter = np.linspace(-0.2, 0.2, len(measured))
    ax.scatter(place + jitter, measured, color=ORANGE, alpha=0.7)
    ax.hlines(measured.mean(), place - 0.35, place + 0.35, color=ORANGE, lw=2)
    ax.axhspan(
        measured.mean() - result.margin,
        measured.mean() + result.margin,
        color=ORANGE,
        alpha=0.12,
        lw=0,
    )
    ax.axhline(result.simulated_mean, color=BLUE, lw=1, ls="--")
    ax.set_xticks(
        [*range(1, len(groups) + 1), place],
        [*(f"group {g + 1}" for g in range(len(groups))), "measured"],
    )
    means = f"simulated {result.simulated_mean:.2f}°, measured {result.measured_mean:.2f}°"
    ax.set(ylabel=ANGLE, title=f"{means}: {result.relative_error_percent:.2f} % apart")
    return figure
