"""Write a comparison as CSV, JSON, Markdown, or LaTeX in the paper's layout."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from textwrap import fill

from suave_des.errors import number_of
from suave_des.estimates import Interval, interval_text
from suave_des.report.compare import Comparison, Difference, RunsNeeded, Summary
from suave_des.report.compared_metrics import FOUND, PAPER_METRICS, ComparedMetric
from suave_des.report.statistics import Tested
from suave_des.report.words import folded

_SUMMARY_HEADINGS = ("manager", "n", "mean", "95% interval", "std", "median", "quartiles")
_DIFFERENCE_HEADINGS = ("difference", "n", "mean", "95% interval", "p", "p (Holm)", "effect")
_LEAST_NAME = 20
"""A column of names is not made narrower than this."""
_RUNS_HEADINGS = ("difference", "for ±", "paired", "not paired", "variance ratio")


def csv_text(comparison: Comparison) -> str:
    """Write all statistics as one table: a row for each group and metric, then one for each pair and metric."""
    import pandas

    frame = pandas.DataFrame([*comparison.summary_rows(), *comparison.difference_rows()], dtype=object)
    if "other" in frame:
        frame.insert(1, "other", frame.pop("other"))
    return frame.to_csv(index=False, lineterminator="\n")


def plain_text(comparison: Comparison, width: int = 95) -> str:
    """Write the conclusions, the tables, and the methods, for a terminal of that width."""
    parts = [_folded(comparison.conclusion, width)]
    for metric in comparison.metrics:
        summaries, differences = comparison.of_metric(metric.name)
        parts.append(f"{metric.heading}\n{_aligned(summary_table(metric, summaries), width)}")
        if censored := search_table(summaries):
            title = f"{metric.heading}, missions that never found it as censored (Kaplan-Meier)"
            parts.append(f"{title}\n{_aligned(censored, width)}")
        if differences:
            table = difference_table(metric, differences)
            if sum(_widths(table)) > width:
                table = difference_table(metric, differences, has_effects=False)
            parts.append(_aligned(table, width))
            parts.append("\n".join(_folded(f"- {each.conclusion}", width) for each in differences))
    needed = runs_table(comparison)
    if needed[1]:
        parts.append(f"runs of each manager that an interval of the difference needs\n{_aligned(needed, width)}")
    parts.append("\n".join(_folded(line, width) for line in remarks(comparison)))
    return "\n\n".join(parts) + "\n"


def _folded(text: str, width: int) -> str:
    return fill(text, width, subsequent_indent="  " if text.startswith("- ") else "", break_on_hyphens=False)


def _widths(table: Table) -> list[int]:
    """Return the width of each column, with the blanks that part all but the first from the one before."""
    headings, rows = table
    first, *others = (max(map(len, column)) for column in zip(headings, *rows, strict=True))
    return [first, *(2 + each for each in others)]


def _aligned(table: Table, width: int) -> str:
    """Write a table with its first column, broken into lines where it is too long, aligned to the left, and the others
    to the right."""
    headings, rows = table
    longest, *widths = _widths(table)
    room = max(width - sum(widths), _LEAST_NAME)
    names = [folded(first, longest if longest <= room else room - 2).split("\n") for first, *_ in (headings, *rows)]
    left = max(len(line.strip()) + 2 * (place > 0) for lines in names for place, line in enumerate(lines))
    written = []
    for (first, *more), (_, *cells) in zip(names, (headings, *rows), strict=True):
        written.append(f"{first.strip():<{left}}{''.join(map(str.rjust, cells, widths))}".rstrip())
        written += (f"  {line.strip()}" for line in more)
    return "\n".join(written)


def json_text(comparison: Comparison) -> str:
    """Write all of the comparison; numbers with all their digits, null where there is none."""
    content = {
        "conclusion": comparison.conclusion,
        "notes": list(comparison.notes),
        "summaries": comparison.summary_rows(),
        "differences": comparison.difference_rows(),
    }
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def markdown_text(comparison: Comparison) -> str:
    """Write the tables and the conclusions, for a page."""
    parts = [_markdown(comparison.conclusion)]
    for metric in comparison.metrics:
        summaries, differences = comparison.of_metric(metric.name)
        parts.append(f"### {capital(metric.heading)}")
        parts.append(_markdown_table(summary_table(metric, summaries)))
        if censored := search_table(summaries):
            parts.append("Missions that never found it as censored (Kaplan-Meier):")
            parts.append(_markdown_table(censored))
        if differences:
            parts.append(_markdown_table(difference_table(metric, differences)))
            parts.append("\n".join(f"- {_markdown(each.conclusion)}" for each in differences))
    if comparison.differences:
        parts.append("### Runs needed")
        parts.append(_markdown_table(runs_table(comparison)))
    parts.extend(_markdown(line) for line in remarks(comparison))
    return "\n\n".join(parts) + "\n"


def latex_text(comparison: Comparison) -> str:
    """Write two tables for LaTeX with booktabs: means and standard deviations as in the paper, and differences."""
    metrics = [each for each in comparison.metrics if each.name in PAPER_METRICS] or list(comparison.metrics)
    lines = [
        r"% needs \usepackage{booktabs}",
        *(f"% Note: {note}." for note in comparison.notes),
        r"\begin{table}",
        r"  \centering",
        rf"  \caption{{{_latex(_sizes(comparison))}}}",
        rf"  \begin{{tabular}}{{l{'rr' * len(metrics)}}}",
        r"    \toprule",
        "    " + "".join(rf" & \multicolumn{{2}}{{c}}{{{_latex(capital(each.heading))}}}" for each in metrics) + r" \\",
        "    " + " ".join(rf"\cmidrule(lr){{{2 * place + 2}-{2 * place + 3}}}" for place in range(len(metrics))),
        "    Manager" + " & Mean & Std" * len(metrics) + r" \\",
        r"    \midrule",
    ]
    by_group: dict[str, list[str]] = {}
    for metric in metrics:
        for each in comparison.of_metric(metric.name)[0]:
            mean, std = (None if each.mean is None else each.mean.value), each.std
            by_group.setdefault(each.group, []).extend(number(value, metric) for value in (mean, std))
    lines += [rf"    {_latex(name)} & {' & '.join(map(_latex, cells))} \\" for name, cells in by_group.items()]
    lines += [r"    \bottomrule", r"  \end{tabular}", r"\end{table}"]
    if comparison.differences:
        lines += _latex_differences(comparison)
    return "\n".join(lines) + "\n"


def _latex_differences(comparison: Comparison) -> list[str]:
    lines = [
        r"\begin{table}",
        r"  \centering",
        rf"  \caption{{{_latex(' '.join(_methods(comparison)))}}}",
        r"  \begin{tabular}{lrrrr}",
        r"    \toprule",
        r"    Difference & Mean & 95\% interval & Effect & $p$ (Holm) \\",
    ]
    for metric in comparison.metrics:
        lines += [r"    \midrule", rf"    \multicolumn{{5}}{{l}}{{{_latex(capital(metric.heading))}}} \\"]
        for each in comparison.of_metric(metric.name)[1]:
            name, _, mean, interval, _, p, effect = _difference_cells(each, metric)
            cells = [_latex(name), *(_latex_number(cell) for cell in (mean, interval, effect, p))]
            lines.append(rf"    {' & '.join(cells)} \\")
    return [*lines, r"    \bottomrule", r"  \end{tabular}", r"\end{table}"]


# Tables as headings and cells of text, which all formats but CSV and JSON share.

Cells = tuple[str, ...]
Table = tuple[Cells, list[Cells]]
"""Headings and rows."""


def summary_table(metric: ComparedMetric, summaries: Sequence[Summary]) -> Table:
    """Return the estimates of each group; a share has neither spread nor quartiles."""
    width = 4 if metric.name == FOUND else len(_SUMMARY_HEADINGS)
    return _SUMMARY_HEADINGS[:width], [_summary_cells(each, metric)[:width] for each in summaries]


def search_table(summaries: Sequence[Summary]) -> Table | None:
    """Return search times in which missions that never found the pipeline are censored; None for other metrics."""
    horizons_s = {each.search.horizon_s for each in summaries if each.search is not None}
    if not horizons_s:
        return None
    headings = ("manager", f"mean to {min(horizons_s):.0f} s", "95% interval", "half found by", "95% interval")
    return headings, [_search_cells(each) for each in summaries]


def difference_table(metric: ComparedMetric, differences: Sequence[Difference], *, has_effects: bool = True) -> Table:
    """Return the difference of each pair; for shares, without an effect size."""
    width = 6 if metric.name == FOUND or not has_effects else len(_DIFFERENCE_HEADINGS)
    return _DIFFERENCE_HEADINGS[:width], [_difference_cells(each, metric)[:width] for each in differences]


def runs_table(comparison: Comparison) -> Table:
    """Return the number of runs that an interval needs, for each pair and metric."""
    return _RUNS_HEADINGS, [
        _runs_cells(each, each.runs_needed, comparison.metric(each.metric))
        for each in comparison.differences
        if each.runs_needed
    ]


def _summary_cells(each: Summary, metric: ComparedMetric) -> Cells:
    """Write a row of summary_table."""
    mean, interval = (None, None) if each.mean is None else (each.mean.value, each.mean.interval)
    median, quartiles = (each.quartiles[1], each.quartiles[::2]) if each.quartiles else (None, None)
    spread = (number(each.std, metric), number(median, metric), interval_cell(quartiles, metric))
    return each.group, f"{each.n:,}", number(mean, metric), interval_cell(interval, metric), *spread


def _search_cells(each: Summary) -> Cells:
    """Write a row of search_table."""
    search = each.search
    if search is None:
        return each.group, "", "", "", ""
    mean = search.restricted_mean_s
    low, high = search.median_interval_s
    interval = _seconds(low) + ("" if low is None else f" to {_seconds(high)}")
    return (
        each.group,
        f"{mean.value:.2f}",
        interval_text(mean.interval, ".1f"),
        _seconds(search.median_s),
        interval,
    )


def _seconds(value: float | None) -> str:
    return "not reached" if value is None else f"{value:.0f}"


def _difference_cells(each: Difference, metric: ComparedMetric) -> Cells:
    """Write a row of difference_table."""
    name = f"{each.first} - {each.second}"
    n = f"{each.n[0]:,}" if each.pairing.is_paired or each.n[0] == each.n[-1] else f"{each.n[0]:,}, {each.n[-1]:,}"
    if each.difference is None or each.tested is None:
        return name, n, "", "", "", "", ""
    mean, interval = number(each.difference.value, metric), interval_cell(each.difference.interval, metric)
    return name, n, mean, interval, p_cell(each.tested.p), p_cell(each.p_holm), _effect(each.tested)


def _effect(tested: Tested) -> str:
    if tested.effect is None:
        return ""
    interval = interval_text(tested.effect_interval, ".2f")
    return f"{tested.effect:.2f} ({interval})" if interval else f"{tested.effect:.2f}"


def _runs_cells(each: Difference, needed: RunsNeeded, metric: ComparedMetric) -> Cells:
    """Write a row of runs_table."""
    ratio = "" if each.variance_ratio is None else f"{each.variance_ratio:.1f}"
    paired = f"{needed.paired:,}" if needed.paired else ""
    unpaired = f"{needed.unpaired:,}" if needed.unpaired else "over 10,000,000"
    half_width = f"{100 * needed.half_width:g}%" if metric.name == FOUND else f"{needed.half_width:.4g} {metric.unit}"
    return f"{each.first} - {each.second}", half_width.strip(), paired, unpaired, ratio


def number(value: float | None, metric: ComparedMetric) -> str:
    """Write a value of a metric: a share in per cent, others with the paper's decimals; empty for None."""
    if value is None:
        return ""
    return f"{100.0 * value:.1f}%" if metric.name == FOUND else f"{value:.{metric.decimals}f}"


def interval_cell(interval: Interval | None, metric: ComparedMetric) -> str:
    """Write an interval; empty for None."""
    if interval is not None and metric.name == FOUND:
        return f"{interval_text((100 * interval[0], 100 * interval[1]), '.1f')}%"
    return interval_text(interval, f".{metric.interval_decimals}f")


def p_cell(p: float | None) -> str:
    """Write a p-value with two significant digits."""
    if p is None:
        return ""
    if p < 1e-300:  # next to the least that a float can hold
        return "<1e-300"
    return f"{p:.3f}" if p >= 0.001 else f"{p:.0e}"


def remarks(comparison: Comparison) -> list[str]:
    """Describe how missions were compared and why, and caveats about the data."""
    return [*_methods(comparison), *(f"Note: {note}." for note in comparison.notes)]


def _methods(comparison: Comparison) -> list[str]:
    """Describe which differences are paired and why, and how they are tested and estimated."""
    tested = [each for each in comparison.differences if each.tested is not None]
    whys: dict[str, dict[str, None]] = {}
    for each in tested:
        whys.setdefault(each.pairing.why, {})[f"{each.first} - {each.second}"] = None
    lines = [f"{capital(why)}{'' if len(whys) == 1 else f' ({_listed(pairs)})'}." for why, pairs in whys.items()]
    tests = dict.fromkeys(each.tested.name for each in tested if each.tested is not None)
    if tests:
        counted = f", Holm's correction over all {len(tested)}" if len(tested) > 1 else ""
        lines.append(f"Tests: {', '.join(tests)}; two-sided{counted}.")
    effects = dict.fromkeys(each.tested.effect_name for each in tested if each.tested is not None)
    lines.extend(_EFFECTS[name] for name in effects if name)
    methods = [each.mean.method for each in comparison.summaries if each.mean and each.mean.interval]
    methods += [each.difference.method for each in tested if each.difference and each.difference.interval]
    if methods:
        lines.append(f"95% intervals: {', '.join(dict.fromkeys(methods))}.")
    return lines


_EFFECTS = {
    "rank-biserial": "Effect: rank-biserial correlation, 1 if the first has the greater value in all pairs.",
    "A12": "Effect: A12, the probability that a mission of the first has the greater value.",
}


def _listed(names: Iterable[str]) -> str:
    known = list(names)
    return ", ".join(known[:4]) + (f" and {len(known) - 4} more" if len(known) > 4 else "")


def _sizes(comparison: Comparison) -> str:
    sizes = {each.group: each.n for each in comparison.of_metric(comparison.metrics[0].name)[0]}
    if len(set(sizes.values())) == 1:
        return f"{number_of(next(iter(sizes.values())), comparison.counted)} for each manager."
    return "; ".join(f"{name}: {number_of(n, comparison.counted)}" for name, n in sizes.items()) + "."


def capital(text: str) -> str:
    """Begin a text with a capital, and leave the rest as it is."""
    return text[:1].upper() + text[1:]


_LATEX = str.maketrans(
    {
        **{character: f"\\{character}" for character in "&%$#_{}"},
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
        "|": r"\textbar{}",
    }
)


def _latex(text: str) -> str:
    return text.translate(_LATEX)


def _latex_number(cell: str) -> str:
    """Write a cell of numbers: with a minus, and powers of ten."""
    mantissa, is_power, exponent = cell.partition("e-")
    if is_power:
        return rf"${mantissa} \cdot 10^{{-{int(exponent)}}}$"
    return " to ".join(f"${_latex(part)}$" if part.startswith("-") else _latex(part) for part in cell.split(" to "))


_MARKDOWN = str.maketrans({**{character: f"\\{character}" for character in r"\`*_[]|"}, "<": "&lt;", ">": "&gt;"})


def _markdown(text: str) -> str:
    return text.translate(_MARKDOWN)


def _markdown_table(table: Table) -> str:
    headings, rows = table
    lines = ["| " + " | ".join(headings) + " |", "| --- |" + " ---: |" * (len(headings) - 1)]
    lines += ["| " + " | ".join(map(_markdown, row)) + " |" for row in rows]
    return "\n".join(lines)


WRITERS: Mapping[str, Callable[[Comparison], str]] = {
    "csv": csv_text,
    "json": json_text,
    "markdown": markdown_text,
    "latex": latex_text,
}
"""Writers by the name of their format."""
ENDINGS = {".csv": "csv", ".json": "json", ".md": "markdown", ".tex": "latex"}
"""Formats by the ending of a file's name."""
