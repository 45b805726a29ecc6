"""The report as one HTML page that needs nothing else."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files
from string import Template
from typing import TYPE_CHECKING, Any

from flockwire_recorder.graph_picture import graph_svg
from flockwire_recorder.reading import Trace
from flockwire_recorder.summary import Summary

if TYPE_CHECKING:
    from flockwire_recorder.figures import Picture

UNKNOWN = "\N{EN DASH}"


def page(trace: Trace, summary: Summary, pictures: Sequence[Picture], probe: dict[str, Any] | None) -> str:
    """Return the page; figures are embedded, all text from the trace is escaped. `probe` is what probe.json holds."""
    template = Template((files("flockwire_recorder") / "report_template.html").read_text(encoding="utf-8"))
    failed = len(summary.failures())
    return template.substitute(
        name=escape(trace.swarm.name.replace("_", " ")),
        verdict="all checks passed" if not failed else f"{failed} of {len(summary.checks)} checks failed",
        verdict_class="bad" if failed else "good",
        subtitle=_subtitle(trace, summary),
        alarm="".join(f'<p class="stop">Emergency stop: {escape(stop.reason)}</p>' for stop in trace.stops),
        tiles="".join(f'<div class="tile"><b>{value}</b><span>{text}</span></div>' for value, text in _tiles(summary)),
        checks=_checks(summary),
        missing=_missing(summary),
        figures="".join(_figure(picture) for picture in pictures),
        graph=graph_svg(trace.swarm.topology),
        latency=_latency(summary),
        deadlines=_deadlines(summary),
        agents=_processes(trace, summary),
        rejected=_rejected(summary),
        probe=_probe(probe) if probe else "",
        toml=escape(trace.metadata.get("toml", "")),
        versions=_versions(trace),
    )  # fmt: skip


def _subtitle(trace: Trace, summary: Summary) -> str:
    drones = f"{summary.drones} drone{'s' if summary.drones != 1 else ''}"
    started = trace.metadata.get("started", "").replace("T", " ").replace("+00:00", " UTC")
    return escape(" · ".join(part for part in (drones, f"{summary.duration_s:.1f} s recorded", started) if part))


def _tiles(summary: Summary) -> Iterable[tuple[str, str]]:
    yield length(summary.formation_error_m.rms_tail), "formation error, rms in the tail"
    yield length(summary.observation_error_m.max_tail), "observation error, largest in the tail"
    yield number(summary.formation_error_m.settled_s, "s"), "until the formation had settled"
    yield length(summary.min_distance_uav_m), "smallest distance between drones"
    if summary.min_distance_obstacle_m is not None:
        yield length(summary.min_distance_obstacle_m), "smallest distance to an obstacle"
    yield number(summary.max_speed_m_s, "m/s"), "highest speed"
    yield number(summary.latency_ms["pose_to_command"].p99, "ms"), "pose to command, 99th percentile"


def _checks(summary: Summary) -> str:
    rows = [
        (
            '<span class="yes">✓</span>' if check.ok else '<span class="no">✗</span>',
            escape(check.name),
            number(check.value, check.unit) if check.value is not None else escape(check.reason),
            escape(check.rule),
        )
        for check in summary.checks
    ]
    return _table(("", "check", "found", "must be"), rows, numeric=())


def _missing(summary: Summary) -> str:
    if not summary.missing:
        return ""
    sentences = "".join(f"<li>{escape(sentence)}</li>" for sentence in summary.missing)
    return f"<section><h2>What the trace lacks</h2><ul>{sentences}</ul></section>"


def _figure(picture: Picture) -> str:
    data = b64encode(picture.path.read_bytes()).decode()
    image = f'<img alt="{escape(picture.title)}" src="data:image/png;base64,{data}">'
    return f"<figure>{image}<figcaption><b>{escape(picture.title)}.</b> {escape(picture.caption)}</figcaption></figure>"


def _latency(summary: Summary) -> str:
    rows = [
        (escape(hop.replace("_to_", " → ")), number(delay.p50, "ms"), number(delay.p99, "ms"))
        for hop, delay in summary.latency_ms.items()
    ]
    return _table(("hop", "median", "99 %"), rows, numeric=(1, 2))


def _deadlines(summary: Summary) -> str:
    found = summary.deadlines
    row = [f"{count:,}" for count in (found.ticks, found.late_1ms, found.late_5ms, found.skipped)]
    return _table(("agents' steps", "over 1 ms late", "over 5 ms late", "skipped"), [row], numeric=(0, 1, 2, 3))


def _processes(trace: Trace, summary: Summary) -> str:
    rows = []
    for vitals in sorted(trace.vitals, key=lambda vitals: vitals.last.identity):
        last = vitals.last
        share = summary.rate.get(last.identity)
        rate = UNKNOWN if share is None else f"{100 * share:.1f} %"
        rows.append(
            (
                escape(last.identity), escape(last.report.phase), rate,
                f"{last.steps:,}", f"{last.late_1ms:,}", f"{last.late_5ms:,}", f"{last.skipped:,}",
                f"{100 * vitals.cpu:.1f} %", f"{last.resident / 2**20:.0f} MB",
                f"{sum(count for _, count in last.rejected):,}", f"{last.refused:,}", escape(", ".join(vitals.links)),
            )
        )  # fmt: skip
    head: tuple[str, ...] = (
        "process",
        "last phase",
        "rate",
        "steps",
        "> 1 ms",
        "> 5 ms",
        "skipped",
        "cpu",
        "memory",
        "rejected",
        "refused",
    )
    head += ("linked to, by certificate",)
    return _table(head, rows, numeric=range(2, 11)) if rows else '<p class="muted">No process told how it is.</p>'


def _rejected(summary: Summary) -> str:
    counts = summary.messages
    text = f"{counts.recorded:,} messages recorded, {counts.lost:,} lost on the way to the recorder, "
    text += f"{counts.rejected:,} turned away by their receivers."
    rows = [(escape(key), f"{count:,}") for key, count in counts.rejected_by_key.items()]
    return f"<p>{text}</p>" + (_table(("key and reason", "messages"), rows, numeric=(1,)) if rows else "")


def _probe(results: dict[str, Any]) -> str:
    """Tell what the conformance probe found: a row for each attacker."""
    wrong = [escape(sentence) for sentence in (*results["leaks"], *results["blocked"])]
    rows = [
        (
            escape(attacker["identity"]), escape(attacker["mode"]), str(attacker["links"]),
            f"{len(attacker['heard'])} of {len(attacker['heard_expected'])}",
            f"{len(attacker['said'])} of {len(attacker['said_expected'])}",
            str(attacker["refused"]),
        )
        for attacker in results["attackers"]
    ]  # fmt: skip
    verdict = f"{len(results['leaks'])} leaks, {len(results['blocked'])} blocked, in {results['seconds']:g} s."
    head = ("attacker's certificate", "as", "links", "heard, of what it may", "said, of what it may", "refused")
    table = _table(head, rows, numeric=range(2, 6))
    sentences = "".join(f"<li>{sentence}</li>" for sentence in wrong)
    return (
        f"<section><h2>Conformance probe</h2><p>{verdict}</p><ul>{sentences}</ul>"
        f"<details><summary>All {len(rows)} attackers</summary>{table}</details></section>"
    )


def _versions(trace: Trace) -> str:
    named = (("flockwire", "version"), ("Zenoh", "zenoh"), ("Python", "python"), ("host", "host"), ("seed", "seed"))
    return escape(" · ".join(f"{text} {trace.metadata[key]}" for text, key in named if trace.metadata.get(key)))


def _table(head: Sequence[str], rows: Iterable[Sequence[str]], numeric: Iterable[int]) -> str:
    """Return a table of HTML cells, the columns `numeric` flush right."""
    right = set(numeric)
    mark = ['class="n"' if column in right else "" for column in range(len(head))]
    top = "".join(f"<th {kind}>{escape(text)}</th>" for kind, text in zip(mark, head, strict=True))
    body = "".join(
        f"<tr>{''.join(f'<td {kind}>{cell}</td>' for kind, cell in zip(mark, row, strict=True))}</tr>" for row in rows
    )
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"


def number(value: float | None, unit: str) -> str:
    """Return a value with three digits and its unit, a dash for None."""
    return UNKNOWN if value is None else f"{value:.3g} {unit}".strip()


def length(value: float | None) -> str:
    """Return a length in the unit that suits it, a dash for None; `value` in m."""
    if value is None:
        return UNKNOWN
    return f"{1000 * value:.1f} mm" if abs(value) < 0.1 else f"{value:.2f} m"
