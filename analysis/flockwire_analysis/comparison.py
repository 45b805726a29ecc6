"""Flights, or groups of flights, beside each other: means, intervals, and a paired test against the first group.

The table is text, CSV or LaTeX.

A mean's interval is Student's, 95 %. Flights of two groups that have the same name (their place in the group's folder)
are a pair: the difference is that of each pair, its interval Student's, and p is that of the paired t-test (two-sided).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain
from math import isfinite, nan
from typing import NamedTuple

from scipy import stats

from flockwire_analysis.key_figures import Summary
from flockwire_analysis.tables import aligned, commas, escape, tabular

PER_GROUP = ("flights", "mean", "low", "high")
_NEGATIVE = re.compile(r"-(?=\d)")  # the sign of a number
PER_PAIR = ("pairs", "difference", "low", "high", "p")
Value = float | None  # None: unknown
_NONE = (0, None, None, None, None)


class Quantity(NamedTuple):
    """One row of the table."""

    name: str
    unit: str
    of: Callable[[Summary], Value]


QUANTITIES = (
    Quantity("formation error, tail", "mm", lambda s: _times(1e3, s.formation_error_m.max_tail)),
    Quantity("formation error, tail, rms", "mm", lambda s: _times(1e3, s.formation_error_m.rms_tail)),
    Quantity("observation error, tail", "mm", lambda s: _times(1e3, s.observation_error_m.max_tail)),
    Quantity("settled after", "s", lambda s: s.formation_error_m.settled_s),
    Quantity("smallest distance", "m", lambda s: s.min_distance_uav_m),
    Quantity("to an obstacle", "m", lambda s: s.min_distance_obstacle_m),
    Quantity("highest speed", "m/s", lambda s: s.max_speed_m_s),
    Quantity("pose to command, p99", "ms", lambda s: s.latency_ms["pose_to_command"].p99),
    Quantity("failed checks", "", lambda s: float(len(s.failures()))),
)


@dataclass(frozen=True, slots=True)
class Group:
    """Flights that belong together; each has a `name` that is its own in the group."""

    name: str
    flights: dict[str, Summary]


class Mean(NamedTuple):
    """The mean of `size` flights, or pairs, and its interval; `low` and `high` are None for a single value.

    `p` is that of the paired t-test, None if all differences are equal; a mean of flights has none.
    """

    size: int
    mean: float
    low: Value = None
    high: Value = None
    p: Value = None


class Row(NamedTuple):
    """One quantity: a mean for each group, and for each but the first the difference to the first, None if unknown."""

    quantity: Quantity
    means: tuple[Mean | None, ...]
    differences: tuple[Mean | None, ...]


def groups_of(names: Sequence[str], flights: Sequence[dict[str, Summary]]) -> list[Group]:
    """Return a group for each name; for three single flights (named "") or more, also one of all."""
    groups = [Group(name, one) for name, one in zip(names, flights, strict=True)]
    if len(groups) > 2 and all("" in one for one in flights):
        groups.append(Group("all", {name: one[""] for name, one in zip(names, flights, strict=True)}))
    return groups


def comparison(groups: Sequence[Group]) -> tuple[Row, ...]:
    """Return the rows of the table of `groups`, at least one."""
    rows = []
    for quantity in QUANTITIES:
        values = [{name: quantity.of(summary) for name, summary in group.flights.items()} for group in groups]
        means = tuple(mean_of([value for value in one.values() if value is not None]) for one in values)
        rows.append(Row(quantity, means, tuple(difference_of(values[0], one) for one in values[1:])))
    return tuple(rows)


def mean_of(values: Sequence[float]) -> Mean | None:
    """Return the mean of `values` with its interval, t s / sqrt(n) on either side; None without values."""
    confidence = 0.95
    if not values:
        return None
    count, mean = len(values), sum(values) / len(values)
    if count == 1:
        return Mean(1, mean)
    half = float(stats.t.ppf(0.5 + confidence / 2, count - 1) * stats.sem(values))
    return Mean(count, mean, mean - half, mean + half)


def difference_of(first: dict[str, Value], other: dict[str, Value]) -> Mean | None:
    """Return the mean of `other` minus `first` over the names that both have; None for fewer than two pairs."""
    deltas = [b - a for name, a in first.items() if a is not None and (b := other.get(name)) is not None]
    found = mean_of(deltas)
    if found is None or found.size == 1:
        return None
    p = float(stats.ttest_1samp(deltas, 0.0).pvalue) if found.low != found.high else nan
    return found._replace(p=p if isfinite(p) else None)


def _times(factor: float, value: Value) -> Value:
    return None if value is None else factor * value


def as_text(groups: Sequence[Group], rows: Sequence[Row]) -> list[str]:
    """Return the lines of a table: a column for each group, and one for each difference to the first."""
    return aligned(_table(groups, rows, ", {}", " - "))


def as_csv(groups: Sequence[Group], rows: Sequence[Row]) -> str:
    """Return the table as CSV, with all digits; unknown values are empty."""
    head = [f"{group.name}: {name}" for group in groups for name in PER_GROUP]
    head += [f"{group.name} - {groups[0].name}: {name}" for group in groups[1:] for name in PER_PAIR]
    lines: list[list[object]] = [["quantity", "unit", *head]]
    for row in rows:
        found = [*((mean or _NONE)[:-1] for mean in row.means), *(one or _NONE for one in row.differences)]
        lines.append([row.quantity.name, row.quantity.unit, *chain.from_iterable(found)])
    return commas(lines)


def as_latex(groups: Sequence[Group], rows: Sequence[Row]) -> str:
    """Return the table as LaTeX's tabular, for a paper; needs the package booktabs."""
    heads, *lines = _table(groups, rows, " [{}]", " $-$ ", escape)
    return tabular(heads, [[_NEGATIVE.sub("$-$", cell) for cell in line] for line in lines])


def _table(
    groups: Sequence[Group], rows: Sequence[Row], unit: str, minus: str, written: Callable[[str], str] = str
) -> list[list[str]]:
    """Return the cells of a table, its heads first, with names as `written`."""
    first, *others = (written(group.name) for group in groups)
    paired = any(difference is not None for row in rows for difference in row.differences)
    table = [["", first, *others, *(f"{other}{minus}{first}" for other in others if paired)]]
    for row in rows:
        name = row.quantity.name + (unit.format(row.quantity.unit) if row.quantity.unit else "")
        table.append([name, *map(_mean, row.means), *map(_difference, row.differences if paired else ())])
    return table


def _mean(mean: Mean | None) -> str:
    if mean is None:
        return "unknown"
    number, *bounds = [f"{value:.4g}" for value in (mean.mean, mean.low, mean.high) if value is not None]
    return f"{number} [{', '.join(bounds)}]" if bounds else number


def _difference(one: Mean | None) -> str:
    if one is None:
        return "no pairs"
    return f"{_mean(one)}, {'equal' if one.p is None else f'p = {one.p:.2g}'}"
