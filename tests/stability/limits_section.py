"""The section of docs/LIMITS.md about the tests of stability: where each method stops holding, and what to use instead."""

import re

# Methods by the names that people call them, without the settings that they have by default.
SHORT = {
    "moments, finest level 1": "moments",
    "histograms, 9 x 32 bins, stride 8": "histograms",
    "pyramid, stride 32": "pyramid",
    "tucker, tolerance 0.1": "tucker",
    "cp, rank 16": "cp",
    "pyramid, stride 32, --normals": "pyramid with --normals",
}
BEGIN, END = "<!-- stability: begin -->", "<!-- stability: end -->"


def number(x):
    return f"{x:.3g}"


def failing(test, series):
    """ "everywhere", "from 16 on", "up to 2", "at 2 and 8", or nothing."""
    points = sorted((point["x"], point.get("value")) for point in test["points"] if point["series"] == series)
    fails = [value is None or value > test["tolerable"] for _, value in points]
    failed = [number(x) for (x, _), fail in zip(points, fails) if fail]
    if not any(fails):
        return ""
    if all(fails):
        return "everywhere"
    if not any(fails[: fails.index(True)]) and all(fails[fails.index(True) :]):
        return f"from {failed[0]} on"
    if all(fails[: len(failed)]):
        return f"up to {failed[-1]}"
    return "at " + ", ".join(failed[:-1]) + (" and " if len(failed) > 1 else "") + failed[-1]


def series_of(test):
    return list(dict.fromkeys(point["series"] for point in test["points"]))


def sentence(test):
    """What fails, and from where on."""
    found = {series: failing(test, series) for series in series_of(test)}
    parts = [f"{SHORT.get(series, series)} {where}" for series, where in found.items() if where]
    return (
        f"Not within {number(test['tolerable'])}: {'; '.join(parts)}."
        if parts
        else f"All are within {number(test['tolerable'])}."
    )


def section(results):
    """Markdown, between the two marks."""
    lines = [
        BEGIN,
        "",
        "## Where methods stop holding",
        "",
        "Written by `make stability`; the figures are in [stability.json](stability.json), and `glint-bench --report docs/stability.json -o page.html` makes a "
        "page of them.",
        "",
        "One thing is changed at a time, on maps of 512x512 texels, up to where methods fail. A method holds where its figure is below the dashed line. Bin maps "
        "and histograms are asked for boxes of the same second moments, and compared with brute force over such boxes. Methods have the settings of glint-bench "
        "--quick: pyramids of stride 32, tucker with a tolerance of .1, cp of rank 16.",
        "",
        "![Each test's curves](stability.png)",
        "",
        "| test | figure over | what fails, and from where on | instead |",
        "|---|---|---|---|",
    ]
    for test in results["tests"]:
        lines.append(f"| **{test['title']}.** {test['question']} | {test['axis']} | {sentence(test)} | {test['instead']} |")
    return "\n".join([*lines, "", END])


def with_section(page, results):
    """A page with the section in the place of an earlier one, or at its end."""
    text = section(results)
    pattern = re.escape(BEGIN) + ".*" + re.escape(END)
    if re.search(pattern, page, re.DOTALL):
        return re.sub(pattern, lambda _: text, page, flags=re.DOTALL)
    return page.rstrip("\n") + "\n\n" + text + "\n"
