"""Charts of the page of measurements."""

import re

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

LABELS = {
    "pyramid": "pyramid",
    "cp16": "cp",
    "cp32": "cp",
    "tucker-tolerance": "tucker",
    "pca-tolerance": "pca",
    "moments": "moments",
}
# Of methods, the same in every chart.
COLOURS = {
    "pyramid": "C0",
    "cp": "C1",
    "tucker": "C2",
    "pca": "C3",
    "bin map": "C4",
    "histograms": "C5",
    "moments": "C6",
    "brute force": "0.5",
    "light": "C8",
    "displacement": "C9",
}
MARKERS = ("o", "s", "^", "D", "v")  # of maps


def chart(data, column, label, path):
    figure, axis = plt.subplots(figsize=(6, 4))
    names = sorted({name for name, _ in data})
    for (name, kind), point in data.items():
        if point[column] is not None:
            axis.plot(point[column], point[1], MARKERS[names.index(name)], color=COLOURS[LABELS[kind]], markersize=7)
    legend(axis, dict.fromkeys(LABELS[kind] for _, kind in data), names)
    finish(figure, axis, path, xlabel=label, ylabel="relative L2 error, mean over octaves")


def legend(axis, methods, maps):
    """Entries for the colours of methods and the markers of maps."""
    for method in methods:
        axis.plot([], [], "-", color=COLOURS[method], label=method, linewidth=4)
    for name, marker in zip(maps, MARKERS):
        axis.plot([], [], marker, color="0.3", label=name)


def plain_numbers(axis):
    """Ticks of a log axis without powers; 2 and 5 are labelled, too, where there are few others."""
    low, high = axis.get_view_interval()
    is_short = high < 50 * low
    axis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.set_minor_formatter(lambda value, _: f"{value:g}" if is_short and f"{value:e}"[0] in "25" else "")


def finish(figure, axis, path, scales=None, **labels):
    axis.set(**(scales or {"xscale": "log", "yscale": "log"}), **labels)
    for one in (axis.xaxis, axis.yaxis):
        if one.get_scale() == "log":
            plain_numbers(one)
    axis.grid(True, which="both", color="0.92", linewidth=0.6)
    axis.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1, 0.5))
    figure.savefig(path, dpi=110, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)


def light_error_chart(light, path):
    """Error of the product integral against the order, for every environment and roughness of the lobes."""
    figure, axis = plt.subplots(figsize=(6, 4))
    lights = list(dict.fromkeys(row["light"] for row in light["errors_by_order"]))
    styles = dict(zip(sorted({row["sigma_r"] for row in light["errors_by_order"]}), (":", "-", "--")))
    for k, name in enumerate(lights):
        for sigma, style in styles.items():
            rows = [
                row
                for row in light["errors_by_order"]
                if row["light"] == name and row["sigma_r"] == sigma and row["order"] >= 5
            ]
            axis.plot(
                [row["order"] for row in rows],
                [row["none"] for row in rows],
                "o" + style,
                color=f"C{k}",
                markersize=4,
                label=f"{name.replace('_', ' ')}, roughness {sigma:.2g}",
            )
    finish(figure, axis, path, xlabel="order", ylabel="relative RMS error against quadrature")
    return path.name


def light_time_chart(light, path):
    """Time of the product integral, and of Monte Carlo for the same error."""
    figure, axis = plt.subplots(figsize=(6, 4))
    lights = list(dict.fromkeys(row["light"] for row in light["times_at_equal_error"]))
    for k, name in enumerate(lights):
        rows = [row for row in light["times_at_equal_error"] if row["light"] == name]
        errors = [row["nearest"]["error"] for row in rows]
        label = name.replace("_", " ")
        axis.plot(errors, [row["nearest"]["us"] for row in rows], "o-", color=f"C{k}", label=f"{label}, harmonics")
        axis.plot(
            errors, [row["nearest"]["monte_carlo_us"] for row in rows], "x--", color=f"C{k}", label=f"{label}, Monte Carlo"
        )
        for row in rows:
            axis.annotate(
                f"{row['order']}",
                (row["nearest"]["error"], row["nearest"]["us"]),
                textcoords="offset points",
                xytext=(5, 4),
                fontsize=7,
            )
    finish(figure, axis, path, xlabel="relative RMS error against quadrature", ylabel="microseconds of one shading point")
    return path.name


def stride_chart(rows, path):
    """Bytes of accumulated histograms against the time of a query, along the strides of their tables."""
    figure, axis = plt.subplots(figsize=(6, 4))
    values = {row["figure"]: row["value"] for row in rows}
    strides = {
        int(match[1])
        for figure_name in values
        if (match := re.fullmatch(r"bytes of histograms, stride (\d+), \S+", figure_name))
    }
    names = sorted({figure_name.split(", ")[2] for figure_name in values if figure_name.startswith("bytes of histograms")})
    for k, name in enumerate(names):
        for size, style in ((64, "o:"), (256, "s-"), (1024, "^--")):
            points = [
                (values[f"bytes of histograms, stride {s}, {name}"], values[f"histogram of {size}^2, stride {s}, {name}"], s)
                for s in sorted(strides)
            ]
            axis.plot(
                [p[0] for p in points],
                [p[1] for p in points],
                style,
                color=f"C{k}",
                markersize=5,
                label=f"{name}, {size}$^2$ texels",
            )
            if size == 256:
                for megabytes, us, stride in points:
                    axis.annotate(f"{stride}", (megabytes, us), textcoords="offset points", xytext=(4, 4), fontsize=7)
    finish(figure, axis, path, xlabel="MB (numbers: stride in texels)", ylabel="microseconds of a histogram")
    return path.name


def paper_seconds(text):
    """The shortest time that a paper's figure names, "22 to 36 min, 6 cores"; nothing if it names none."""
    found = [
        float(match[1]) * {"s": 1, "min": 60}[match[2]] for match in re.finditer(r"([\d.]+)(?: to [\d.]+)? (s|min)\b", text)
    ]
    return min(found) if found else None


def preparation_chart(entries, path):
    """Times to prepare: bars over the maps, and crosses for the papers."""
    figure, axis = plt.subplots(figsize=(6, 3.4))
    found = [entry for entry in entries if entry[2]]
    for k, (_, method, seconds, _, paper) in enumerate(found):
        axis.plot([min(seconds), max(seconds)], [k, k], "o-", color=COLOURS[method], linewidth=5, markersize=6)
        if (theirs := paper_seconds(paper)) is not None:
            axis.plot(theirs, k, "x", color="0.3", markersize=7)
    axis.set_yticks(range(len(found)), [title for title, *_ in found])
    axis.invert_yaxis()
    axis.plot([], [], "o-", color="0.5", linewidth=5, label="here, two cores")
    axis.plot([], [], "x", color="0.3", label="paper, its machine")
    finish(figure, axis, path, {"xscale": "log"}, xlabel="seconds")
