"""Numbers as words of the page of measurements."""


def digits(value):
    """Three digits, without an exponent where the number is large."""
    return f"{value:.3g}" if abs(value) < 1000 else f"{float(f'{value:.3g}'):,.0f}"


def span(values, unit):
    """The value, or the least and the greatest of several."""
    low, high = digits(min(values)), digits(max(values))
    return f"{low if low == high else f'{low} to {high}'} {unit}".strip()


def in_units(values, units):
    """A span in the largest of some units in which its least value is not below .1: [(1e9, "s"), (1e6, "ms")]."""
    if not values:
        return ""
    scale, unit = next(((scale, unit) for scale, unit in units if min(values) >= 0.1 * scale), units[-1])
    return span([value / scale for value in values], unit)


def times(nanoseconds):
    return in_units(nanoseconds, [(1e9, "s"), (1e6, "ms"), (1e3, "µs"), (1, "ns")])


def sizes(megabytes):
    return in_units(megabytes, [(1, "MB"), (1e-3, "kB")])


def percents(errors):
    return span([100 * error for error in errors], "%") if errors else ""
