"""Figures of the chain's stages; each function returns a matplotlib Figure, `save` writes it atomically as SVG.

The figures keep their own white ground, so that they read the same on light and dark pages.
"""

import os
from dataclasses import dataclass
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


def label(name):
    """Readable form of a factor's name."""
    return name.replace("_", " ")


UNITS = {
    "_deg": "°",
    "_mm": " mm",
    "_kPa": " kPa",
    "_kg_m3": " kg/m³",
    "_m_s": " m/s",
    "_s": " s",
}
"""Suffix of a metric's name -> its unit as written behind a number."""


@dataclass(frozen=True)
class Quantity:
    """What a study calibrates, for labels: its name and its unit as written behind a number."""

    name: str
    unit: str

    @property
    def axis(self):
        """Label of an axis."""
        return f"{self.name}{self.brackets}"

    @property
    def brackets(self):
        """The unit in brackets, empty where there is none."""
        return f" [{self.unit.strip()}]" if self.unit else ""

    def value(self, x):
        """A value with its unit: two decimals of an angle, else four digits."""
        return f"{x:.2f}°" if self.unit == "°" else f"{x:.4g}{self.unit}"


def quantity_of(metric):
    """`Quantity` of a run's metric, whose name ends in its unit (angle_of_repose_deg)."""
    for suffix, unit in UNITS.items():
        if metric.endswith(suffix):
            return Quantity(label(metric.removesuffix(suffix)), unit)
    return Quantity(label(metric), "")


ANGLE = quantity_of("angle_of_repose_deg")


def _axes(rows=1, columns=1, size=(5.4, 3.8), **more):
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


def half_normal(table, chosen, quantity=ANGLE):
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
        xlabel=f"|effect|{quantity.brackets}",
        ylabel="half-normal quantile",
        xlim=(0, 1.45 * size.max()),
        ylim=(0, 1.15 * score.max()),
    )
    ax.legend(loc="lower right", frameon=False)
    return figure


def pareto(table, t_limit, bonferroni_limit, alpha=0.05, quantity=ANGLE):
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
    ax.set(xlabel=f"|effect|{quantity.brackets}\nblue raises the {quantity.name}, orange lowers it")
    return figure


def ascent_path(runs, factors, target, best, quantity=ANGLE):
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
    ax.axhline(target, color=ORANGE, lw=1.2, label=f"measured {quantity.value(target)}")
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
        ylabel=quantity.axis,
        xlabel="\n".join(f"{i + 1}. line: {label(f.name)}" for i, f in enumerate(factors)),
    )
    ax.legend(frameon=False)
    return figure


def predicted_actual(surface, quantity=ANGLE):
    """Predicted against simulated response."""
    figure, ax = _axes(size=(4.2, 4.0))
    d = surface.diagnostics
    ax.scatter(d["actual"], d["predicted"], color=BLUE)
    ends = [
        min(d["actual"].min(), d["predicted"].min()),
        max(d["actual"].max(), d["predicted"].max()),
    ]
    ax.plot(ends, ends, color=GREY, lw=1)
    unit = quantity.brackets
    ax.set(
        xlabel=f"simulated {quantity.name}{unit}",
        ylabel=f"predicted by the quadratic model{unit}",
        aspect="equal",
    )
    return figure


def residual_panel(surface, quantity=ANGLE):
    """Normal plot of residuals, residuals against prediction and run, and Cook's distance."""
    d = surface.diagnostics
    figure, ax = _axes(2, 2, size=(7.2, 5.8))
    z = np.sort(d["externally_studentised"])
    q = stats.norm.ppf((np.arange(1, len(z) + 1) - 0.5) / len(z))
    ax[0, 0].scatter(z, q, color=BLUE)
    ax[0, 0].plot(q, q, color=GREY, lw=1)
    ax[0, 0].set(xlabel="externally studentised residual", ylabel="normal quantile")
    for panel, x, name in (
        (ax[0, 1], d["predicted"], f"predicted{quantity.brackets}"),
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


def perturbation(surface, region, quantity=ANGLE):
    """Response along each factor with the others at the centre."""
    figure, ax = _axes()
    x = np.linspace(-1, 1, 81)
    for k, factor in enumerate(region):
        levels = np.zeros((len(x), len(region)))
        levels[:, k] = x
        ax.plot(x, surface.predict(levels), label=f"{factor.code}  {label(factor.name)}")
    ax.set(xlabel="distance from the centre, coded", ylabel=quantity.axis)
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
    """Figure and rows, columns of a grid of `count` panels, two a row so that they read on a narrow page; size: inches
    of one."""
    columns = min(count, 2)
    rows = -(-count // columns)
    figure = plt.figure(figsize=(size[0] * columns, size[1] * rows), layout="constrained")
    return figure, rows, columns


def _label_3d(ax, x, y, z):
    ax.set_xlabel(x, fontsize=8)
    ax.set_ylabel(y, fontsize=8)
    ax.set_zlabel(z, fontsize=8)
    ax.tick_params(labelsize=7)
    ax.locator_params(nbins=4)
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
    ax.set_box_aspect(None, zoom=0.85)


def surfaces(surface, region, quantity=ANGLE):
    """Response surfaces of all pairs of factors, the others at the centre."""
    pairs = _pairs(region)
    with plt.rc_context(STYLE):
        figure, rows, columns = _panels(len(pairs), (3.9, 3.6))
        for n, (i, j) in enumerate(pairs):
            ax = figure.add_subplot(rows, columns, n + 1, projection="3d")
            a, b, y = _slice(surface, region, i, j, 31)
            ax.plot_surface(a, b, y, cmap="viridis", alpha=0.9)
            _label_3d(ax, label(region[i].name), label(region[j].name), quantity.axis)
    return figure


def contours(surface, region, solution, quantity=ANGLE):
    """Contours through the chosen point with the solution set drawn in; for three factors also the set itself."""
    pairs = _pairs(region)
    whole = len(region) == 3 and solution.attainable
    with plt.rc_context(STYLE):
        if whole:
            figure, rows, columns = plt.figure(figsize=(8.2, 7.0), layout="constrained"), 2, 2
        else:
            figure, rows, columns = _panels(len(pairs), (4.1, 3.5))
        for n, (i, j) in enumerate(pairs):
            ax = figure.add_subplot(rows, columns, n + 1)
            _contour(ax, surface, region, i, j, solution, quantity)
        if whole:
            ax = figure.add_subplot(2, 2, 4, projection="3d")
            _solution_set(ax, surface, region, solution, quantity)
    return figure


def _contour(ax, surface, region, i, j, solution, quantity):
    a, b, y = _slice(surface, region, i, j, at=solution.chosen)
    filled = ax.contourf(a, b, y, 12, cmap="viridis", alpha=0.85)
    ax.figure.colorbar(filled, ax=ax, label=quantity.axis, shrink=0.9)
    if y.min() < solution.target < y.max():
        ax.contour(a, b, y, [solution.target], colors="white", linewidths=4.5)
        ax.contour(a, b, y, [solution.target], colors=ORANGE, linewidths=2.5)
    x, z = (region[k].natural(float(solution.chosen[k])) for k in (i, j))
    ax.plot(x, z, "o", color="white", mec="black", ms=9, clip_on=False, zorder=4)
    ax.set(xlabel=label(region[i].name), ylabel=label(region[j].name))
    ax.grid(False)


def _solution_set(ax, surface, region, solution, quantity):
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
    ax.set_title(f"all points that give {quantity.value(solution.target)}", fontsize=9)


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
    # above the axes: the line of the measured value may run anywhere within
    ax.legend(frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, fontsize=9)
    return figure


def yield_loci(runs, loci, curves, measure, section):
    """Yield loci at each particle friction, and the slope over the friction with its interval, beside the measured."""
    figure, (left, right) = _axes(1, 2, (9.6, 4.2))
    end = 1.05 * runs["normal_stress_kPa"].max()
    x = np.array([0.0, end])
    for locus in loci:
        friction, line = locus["particle_friction"], locus[measure]
        points = runs[runs["salt_salt_static_friction"] == friction]
        text = f"µ {friction:g}: {line['slope']:.2f} x {line['intercept_kPa']:+.2f}"
        (drawn,) = left.plot(x, line["slope"] * x + line["intercept_kPa"], label=text)
        left.scatter(
            points["normal_stress_kPa"], points[f"{measure}_kPa"], color=drawn.get_color(), s=18
        )
    slope, intercept = section.measured_slope, section.measured_intercept_kPa
    text = f"measured: {slope:g} x {intercept:+g}"
    left.plot(x, slope * x + intercept, color="black", ls="--", label=text)
    left.set(
        xlabel="normal stress [kPa]",
        ylabel=f"{measure} shear stress [kPa]",
        xlim=(0, None),
        ylim=(0, None),
    )
    left.legend(frameon=False, fontsize=8)
    for (name, curve), colour in zip(curves.items(), (BLUE, GREEN), strict=True):
        mu = np.linspace(curve.low, curve.high, 101)
        value, half = curve.at(mu)
        right.plot(mu, value, color=colour, label=name)
        right.fill_between(mu, value - half, value + half, color=colour, alpha=0.15, lw=0)
    right.axhline(slope, color="black", ls="--", lw=1, label=f"measured {slope:g}")
    right.plot(mu, mu, color=GREY, ls=":", label="slope = particle friction")
    right.set(xlabel="particle friction", ylabel="slope of the yield locus")
    right.legend(frameon=False, fontsize=8)
    return figure


def scaling(table):
    """Angle of repose and restitution over the scale, a line a rule and cohesion."""
    figure, axes = _axes(1, 2, (9.6, 4.2))
    names = {"heap": ANGLE.axis, "drop": "coefficient of restitution, rebound"}
    for ax, (experiment, axis) in zip(axes, names.items(), strict=True):
        cases = table[table["experiment"] == experiment].groupby(["rule", "cohesive"], sort=False)
        for k, ((rule, cohesive), case) in enumerate(cases):
            text = f"{rule} rule, {'cohesive' if cohesive else 'no cohesion'}"
            ax.errorbar(
                case["scale"] * 2 ** (0.03 * (k - 1.5)),
                case["mean"],
                yerr=[case["mean"] - case["low"], case["high"] - case["mean"]],
                marker="o",
                capsize=3,
                label=text,
            )
        ax.set_xscale("log", base=2)
        scales = sorted(table["scale"].unique())
        ax.set_xticks(scales, [f"{x:g}" for x in scales])
        ax.set(xlabel="scale h", ylabel=axis)
    axes[0].legend(frameon=False, fontsize=8)
    return figure


def validation(groups, measured, result, quantity=ANGLE):
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
    simulated, aim = (quantity.value(v) for v in (result.simulated_mean, result.measured_mean))
    means = f"simulated {simulated}, measured {aim}"
    ax.set(ylabel=quantity.axis, title=f"{means}: {result.relative_error_percent:.2f} % apart")
    return figure
