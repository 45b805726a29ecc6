"""Writes the report of a trace: summary.json, figures, the page (templates/report.html) and the replay page."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flockwire_core.wire.status import Status
from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

from flockwire_analysis.key_figures import FILTER_JUDGED, Summary
from flockwire_analysis.reading import read_trace
from flockwire_analysis.recorded import ProcessRecord, Trace, is_virtual
from flockwire_analysis.replay import NAME as REPLAY
from flockwire_analysis.replay import write_replay
from flockwire_analysis.summary import bad_input, summarise

if TYPE_CHECKING:
    from flockwire_analysis.figures.drawing import Picture

SHARED = "flockwire_analysis"  # templates that those of any package may use


def render(package: str, template: str, /, **values: object) -> str:
    """Render a template from the folder templates/ of `package` with `values`.

    Raises jinja2.UndefinedError if the template needs a value that is not given.
    """
    environment = Environment(
        loader=ChoiceLoader([PackageLoader(name) for name in (package, SHARED)]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["data_uri"] = lambda png: f"data:image/png;base64,{b64encode(png.read_bytes()).decode()}"
    return environment.get_template(template).render(values)


UNKNOWN = "\N{EN DASH}"


def page(trace: Trace, summary: Summary, pictures: Sequence[Picture], probe: dict[str, Any] | None) -> str:
    """Return the page; figures are embedded, all text is escaped. `probe` is the content of probe.json.

    The page links to the replay page in the same folder.
    """
    steps, vitals = summary.steps, sorted(trace.vitals, key=lambda vitals: vitals.last.identity)
    return render(
        "flockwire_analysis",
        "report.html",
        name=trace.swarm.name.replace("_", " "),
        failed=len(summary.failures()),
        replay=REPLAY,
        subtitle=_subtitle(trace, summary),
        stops=tuple(dict.fromkeys(stop.reason for stop in trace.stops)),  # each is published several times
        tiles=_tiles(summary),
        checks=[(one.ok if one.judged else None, one.name, one.found(), one.rule) for one in summary.checks],
        phases=_phases(summary),
        missing=summary.missing,
        pictures=pictures,
        latency=[
            (hop.replace("_to_", " → "), number(delay.p50, "ms"), number(delay.p99, "ms"))
            for hop, delay in summary.latency_ms.items()
        ],
        steps=[f"{n:,}" for n in (steps.made, steps.delayed_1ms, steps.delayed_5ms, steps.skipped)],
        processes=[_process(one, summary.rate.get(one.last.identity)) for one in vitals],
        messages=summary.messages,
        rejected=[(key, f"{count:,}") for key, count in summary.messages.rejected_by_key.items()],
        bad_input=[
            (identity, name, f"{count:,}")
            for identity, counts in sorted(bad_input(trace).items())
            for name, count in counts.items()
        ],
        probe=probe,
        attackers=_attackers(probe) if probe else (),
        toml=trace.metadata.get("toml", ""),
        versions=_versions(trace),
    )


def _subtitle(trace: Trace, summary: Summary) -> str:
    drones = f"{summary.drones} drone{'s' if summary.drones != 1 else ''}"
    started = trace.metadata.get("started", "").replace("T", " ").replace("+00:00", " UTC")
    if is_virtual(trace):  # its date means nothing
        started = f"virtual time, seed {trace.metadata['seed']}"
    return " · ".join(part for part in (drones, f"{summary.duration_s:.1f} s recorded", started) if part)


def _tiles(summary: Summary) -> Iterable[tuple[str, str]]:
    yield length(summary.formation_error_m.rms_tail), "formation error, rms in the tail"
    if summary.observation_error_m.max_tail is not None:  # a law may estimate no leader
        yield length(summary.observation_error_m.max_tail), "observation error, largest in the tail"
    yield number(summary.formation_error_m.settled_s, "s"), "until the formation had settled"
    yield length(summary.min_distance_uav_m), "smallest distance between drones"
    if summary.min_distance_obstacle_m is not None:
        yield length(summary.min_distance_obstacle_m), "smallest distance to an obstacle"
    yield number(summary.max_speed_m_s, "m/s"), "highest speed"
    if summary.filtered is not None:
        judged = f", and {summary.conflicts:.1%} for drones and people" if summary.conflicts else ""
        judged += " (the flight judges the filter)" if summary.filtered > FILTER_JUDGED else ""
        yield f"{summary.filtered:.1%}", f"of the law's commands changed by the safety filter{judged}"
    yield number(summary.latency_ms["pose_to_command"].p99, "ms"), "pose to command, 99th percentile"


def _phases(summary: Summary) -> list[tuple[str, ...]]:
    return [
        (
            phase.formation or "the first of the swarm file", number(phase.begin_s, "s"), number(phase.length_s, "s"),
            number(phase.formation_error_m.settled_s, "s"), length(phase.formation_error_m.max_tail),
            length(phase.judged_tail_m), length(phase.observation_error_m.max_tail),
            ", ".join(f"{name}: {number(seconds, 's')}" for name, seconds in phase.without_place_s.items()) or "none",
        )
        for phase in summary.phases
    ]  # fmt: skip


def _process(vitals: ProcessRecord, rate: float | None) -> tuple[str, ...]:
    last = vitals.last
    return (
        last.identity, last.report.phase, UNKNOWN if rate is None else f"{100 * rate:.1f} %",
        f"{last.steps:,}", f"{last.delayed_1ms:,}", f"{last.delayed_5ms:,}", f"{last.skipped:,}",
        f"{100 * vitals.cpu:.1f} %", f"{last.resident / 2**20:.0f} MB",
        f"{sum(count for _, count in last.rejected):,}", f"{last.refused:,}", _clock(last), ", ".join(vitals.links),
    )  # fmt: skip


def _clock(status: Status) -> str:
    """Return the correction of the process's clock and its bound."""
    if status.clock_bound < 0.0:
        return "not known"
    return f"{1e3 * status.clock_offset:+.1f} \u00b1 {1e3 * status.clock_bound:.1f}" if status.clock_bound else "shared"


def _attackers(probe: dict[str, Any]) -> list[tuple[str, ...]]:
    return [
        (
            attacker["identity"], attacker["mode"], str(attacker["links"]),
            f"{len(attacker['received'])} of {len(attacker['received_expected'])}",
            f"{len(attacker['published'])} of {len(attacker['published_expected'])}",
            str(attacker["refused"]),
        )
        for attacker in probe["attackers"]
    ]  # fmt: skip


def _versions(trace: Trace) -> str:
    named = (("flockwire", "version"), ("Zenoh", "zenoh"), ("Python", "python"), ("host", "host"), ("seed", "seed"))
    return " · ".join(f"{text} {trace.metadata[key]}" for text, key in named if trace.metadata.get(key))


def number(value: float | None, unit: str) -> str:
    """Return a value with three digits and its unit, a dash for None."""
    return UNKNOWN if value is None else f"{value:.3g} {unit}".strip()


def length(value: float | None) -> str:
    """Return a length in the unit that suits it, a dash for None; `value` in m."""
    if value is None:
        return UNKNOWN
    return f"{1000 * value:.1f} mm" if abs(value) < 0.1 else f"{value:.2f} m"


def write_report(path: str | Path, out: str | Path, vector: bool = False) -> Summary:
    """Read the trace `path` with its other parts, and write its report as `write_files` does.

    A truncated trace is read up to its end. Raises ValueError for a file that is not a trace of a swarm, OSError if one
    cannot be read or written.
    """
    trace = read_trace(path)
    summary = summarise(trace)
    write_files(trace, summary, Path(out), vector)
    return summary


def write_files(trace: Trace, summary: Summary, out: Path, vector: bool = False) -> None:
    """Write summary.json, figures as PNG (and PDF if `vector`), report.html and replay.html of a flight into `out`.

    The report includes probe.json of `flockwire probe`, if it is in that folder. Raises OSError.
    """
    out.mkdir(parents=True, exist_ok=True)
    (out / "summary.json").write_text(json.dumps(summary.as_json(), indent=2, allow_nan=False) + "\n", encoding="utf-8")
    write_replay(trace, summary, out / REPLAY)
    from flockwire_analysis.figures import draw  # noqa: PLC0415  (matplotlib takes a second to import)

    pictures = draw(trace, out, vector)
    probe = out / "probe.json"
    results = json.loads(probe.read_text(encoding="utf-8")) if probe.exists() else None
    (out / "report.html").write_text(page(trace, summary, pictures, results), encoding="utf-8")
