"""The results of a study: a row for each grid point, and the worst runs with files to repeat them."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import asdict, dataclass
from math import ceil, inf, isfinite
from pathlib import Path
from typing import Any

import tomli_w
from flockwire_analysis.report import UNKNOWN
from flockwire_core.loading import framed_tables
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.wording import InputError
from pydantic import JsonValue
from scipy.stats import binomtest

from flockwire_lab.study.file import GridPoint, Study
from flockwire_lab.study.flight import QUANTITIES, Result
from flockwire_lab.study.variation import Table, vary

SHARES = (0.50, 0.95, 0.99)  # of the runs, of the quantiles


@dataclass(frozen=True, slots=True)
class Quantiles:
    """Bounds that half, 95 %, 99 % and all of the runs keep; None if some of these have no value."""

    p50: float | None
    p95: float | None
    p99: float | None
    worst: float | None
    worst_seed: int


@dataclass(frozen=True, slots=True)
class GridPointFigures:
    """The results of one grid point: `low` and `high` bound the true success rate with 95 % confidence (Wilson)."""

    point: dict[str, JsonValue]
    runs: int
    successes: int
    rate: float
    low: float
    high: float
    failed: dict[str, int]  # number of failed runs by check
    figures: dict[str, Quantiles | None]


@dataclass(frozen=True, slots=True)
class Findings:
    """All rows in the order of the grid, the results in order, and the worst of them, worst first."""

    swarm: str
    plan: Study
    rows: tuple[GridPointFigures, ...]
    results: tuple[Result, ...]
    worst: tuple[Result, ...]

    @property
    def failures(self) -> int:
        """The number of failed runs."""
        return sum(not result.ok for result in self.results)

    def as_json(self) -> dict[str, Any]:
        """Return the content of study.json; equal studies, equal content."""
        return {
            "swarm": self.swarm,
            "study": self.plan.model_dump(mode="json"),
            "runs": len(self.results),
            "failures": self.failures,
            "confidence": 0.95,
            "points": [asdict(row) for row in self.rows],
            "worst": [asdict(result) | self.again(result) for result in self.worst],
        }

    def again(self, result: Result) -> dict[str, str]:
        """Return the files and the command that repeat a worst run; {} for a refused one."""
        if "refused" in result.failed:
            return {}
        stem = f"worst/{result.point}-{result.seed}"
        faults = f" --faults {stem}.faults.toml" if self.plan.faults else ""
        command = f"flockwire sim {stem}.toml --seed {result.seed} --duration {self.plan.duration:g}{faults}"
        return {"swarm": f"{stem}.toml", "command": command}


def find(swarm: Swarm, plan: Study, results: Sequence[Result]) -> Findings:
    """Return the findings of the plan's runs, in any order; runs beyond `plan.runs` are ignored."""
    counted = sorted((r for r in results if r.run < plan.runs), key=lambda r: (r.point, r.run))
    flown = [[result for result in counted if result.point == number] for number in range(len(plan.points))]
    rows = tuple(_row(point, here) for point, here in zip(plan.points, flown, strict=True) if here)
    worst = sorted(counted, key=_goodness)[:5]
    return Findings(swarm.name, plan, rows, tuple(counted), tuple(worst))


def write_worst(findings: Findings, table: Table, out: Path) -> None:
    """Write the swarm files (and faults) of the worst runs into `out`/worst, for `flockwire sim`."""
    folder = out / "worst"
    folder.mkdir(exist_ok=True)
    for old in folder.glob("*.toml"):
        old.unlink()
    for result in findings.worst:
        try:
            varied = vary(findings.plan, table, findings.plan.points[result.point], result.seed)
        except InputError:
            continue
        stem = f"{result.point}-{result.seed}"
        write_flight(varied.table, varied.fault_table if findings.plan.faults else None, folder / stem)


def _row(point: GridPoint, results: list[Result]) -> GridPointFigures:
    successes = sum(result.ok for result in results)
    low, high = wilson(successes, len(results))
    failed = Counter(name for result in results for name in result.failed)
    figures = {
        quantity.key: quantiles([(r.seed, r.figures.get(quantity.key)) for r in results], quantity.high_is_bad)
        for quantity in QUANTITIES
    }
    rate = successes / len(results)
    return GridPointFigures(
        dict(point), len(results), successes, rate, low, high, dict(sorted(failed.items())), figures
    )


def _goodness(result: Result) -> tuple[bool, float, float, int, int]:
    error = result.figures.get("formation_tail_m")
    return result.ok, result.margin, -error if error is not None else 0.0, result.point, result.run


def wilson(successes: int, runs: int) -> tuple[float, float]:
    """Return the 95 % score interval of a rate with `successes` in `runs`, 1 or more (E. B. Wilson, JASA 22, 1927)."""
    interval = binomtest(successes, runs).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)


def quantiles(values: Sequence[tuple[int, float | None]], high_is_bad: bool) -> Quantiles | None:
    """Return the quantiles of (seed, value); a missing value counts as the worst. None when no run has one."""
    if all(value is None for _, value in values):
        return None
    sign = 1.0 if high_is_bad else -1.0
    ranked = sorted((inf if value is None else sign * value, seed) for seed, value in values)
    kept = [ranked[ceil(share * len(ranked) - 1e-9) - 1][0] for share in SHARES]
    p50, p95, p99, worst = (sign * value if isfinite(value) else None for value in (*kept, ranked[-1][0]))
    return Quantiles(p50, p95, p99, worst, ranked[-1][1])


def write_flight(table: Table, faults: Table | None, stem: Path) -> tuple[Path, Path]:
    """Write and return STEM.toml, a swarm file, and STEM.faults.toml, unless `faults` is None. Raises OSError."""
    swarm_file, fault_file = stem.with_name(f"{stem.name}.toml"), stem.with_name(f"{stem.name}.faults.toml")
    swarm_file.write_text(tomli_w.dumps({"name": table["name"], **_without_frames(table)}), encoding="utf-8")
    if faults is not None:
        fault_file.write_text(tomli_w.dumps(faults), encoding="utf-8")
    return swarm_file, fault_file


def _without_frames(table: Table) -> Table:
    """Remove the text of key frames: the swarm file names their file; and the folder of a law that needs none."""
    own = ":" in str(table.get("control", {}).get("law", ""))
    bare = deepcopy({key: value for key, value in table.items() if key != "folder" or own})
    for _, framed in framed_tables(bare):
        framed.pop("frames", None)
    return bare


def label(point: Mapping[str, JsonValue]) -> str:
    """Return a grid point as `key=value` pairs, the last word of each key; of a table, the pairs in it."""
    return ", ".join(f"{key}={shown(value)}" for key, value in _pairs(point)) or "all runs"


def _pairs(table: Mapping[str, JsonValue]) -> Iterator[tuple[str, JsonValue]]:
    for key, value in table.items():
        if isinstance(value, dict) and value:
            yield from _pairs(value)
        else:
            yield key.rpartition(".")[2], value


def shown(value: JsonValue) -> str:
    """Return a value from the grid."""
    return value if isinstance(value, str) else json.dumps(value)


def quantity(value: float | None, unit: str) -> str:
    """Return a figure with its unit, small lengths in mm."""
    if value is None:
        return UNKNOWN
    if unit == "m" and abs(value) < 0.1:
        return f"{value * 1000:.2f} mm"
    return f"{value:.3f} {unit}" if unit == "m" else f"{value:.2f} {unit}"
