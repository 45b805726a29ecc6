"""The replay page of a flight: one HTML file with the flight in it (view/replay.html, view/replay.js)."""

from __future__ import annotations

import json
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from html import escape
from itertools import pairwise
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.fleet import STALE
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase

from flockwire_analysis.key_figures import Summary
from flockwire_analysis.moving_bodies import MovingBody, moving_bodies
from flockwire_analysis.observed import Shown
from flockwire_analysis.phases import Event, events
from flockwire_analysis.recorded import Trace, is_virtual
from flockwire_analysis.sampled import Sampled, sampled, worst_moments
from flockwire_analysis.series import Floats, Samples
from flockwire_analysis.view import FOLDER, SCRIPTS, filled, joined, outline

MOST = 1_200_000  # numbers in a page, about six characters each
MOST_SENSED = MOST // 4  # of these, of moving bodies
SILENT = "silent"
PHASE, RUNG = "phase", "rung"  # kinds of marks: a drone's phase changed, by an order or by the staleness ladder
ORDERLY = (Phase.GROUNDED, Phase.READY, Phase.TAKEOFF, Phase.FORMATION)  # phases whose reasons are no rungs
LISTED = '<h2>Events</h2><ul id="events"></ul>'
NAME = "replay.html"

_stamp = attrgetter("stamp")


def write_replay(trace: Trace, summary: Summary, path: Path) -> Path:
    """Write the replay page of a flight to `path`, and return it. Raises OSError."""
    path.write_text(replay(trace, summary), encoding="utf-8")
    return path


def replay(trace: Trace, summary: Summary) -> str:
    """Return the replay page. It needs no other file and no network; all text of the trace is escaped."""
    failures = len(summary.failures())
    data = {
        **flight_data(trace),
        "verdict": f"{failures} of {len(summary.checks)} checks failed" if failures else "all checks passed",
        "failed": bool(failures),
    }
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return filled(
        FOLDER / "replay.html",
        LISTED,
        title=escape(trace.swarm.name.replace("_", " ")),
        style=joined("style.css"),
        scripts=joined(*SCRIPTS, "replay.js"),
        flight=text,
    )


def flight_data(trace: Trace) -> dict[str, Any]:
    """Return what the page shows: times in s from the first formation's time 0, else from the trace's begin.

    Positions, places and errors are in mm, one for each of `count` steps of `step` s from `begin` on, null where they
    are unknown; `zero` is time 0 in ms of Unix time, without meaning if `virtual`. Others are lists of changes with
    their times.
    """
    for_each = 8  # numbers of one drone at one step
    numbers = sorted(trace.plan.pilot)
    flight = sampled(trace, MOST // (for_each * len(numbers)))
    zero = flight.zero

    def seconds(stamp: int) -> float:
        return round((stamp - zero) / SECOND, 3)

    pilots = trace.plan.pilot
    return {
        "outline": outline(trace.plan),
        "zero": zero // 1_000_000,
        "virtual": is_virtual(trace),
        "begin": (int(flight.stamps[0]) - zero) / SECOND,
        "step": int(np.diff(flight.stamps[:2]).sum() or SECOND) / SECOND,
        "count": len(flight.stamps),
        "drones": {i: _drone(flight, i, seconds) | {"reports": _reports(trace, pilots[i], seconds)} for i in numbers},
        "movers": _movers(flight),
        "others": {
            identity: _reports(trace, identity, seconds)
            for identity in trace.plan.started
            if identity in trace.shown and identity not in pilots.values()
        },
        "marks": [{"t": seconds(mark.stamp), "kind": mark.kind, "text": mark.text} for mark in _marks(trace, flight)],
        "moments": [
            {"t": seconds(moment.stamp), "text": moment.text, "drones": moment.drones}
            for moment in worst_moments(flight)
        ],
    }


def _drone(flight: Sampled, number: int, seconds: Callable[[int], float]) -> dict[str, Any]:
    """Return what the page shows of a drone beside its reports."""
    trace, observed = flight.trace, flight.observation.get(number)
    return {
        "position": _millimetres(flight.positions[number]),
        "place": _millimetres(flight.references[number]),
        "error": _millimetres(flight.formation(number)[:, None])[0],
        "observation": [] if observed is None else _millimetres(observed[:, None])[0],
        "signals": {
            name: [[seconds(stamp), value] for stamp, value in zip(*_thinned(one), strict=True)]
            for name, one in trace.signals.get(number, {}).items()
        },
        "battery": [[seconds(stamp), share] for stamp, share in _battery(trace, number)],
    }


def _movers(flight: Sampled) -> list[list[Any]]:
    """Return steps with the moving bodies that drones sensed: x, y, radius and height of each, in whole mm.

    Of a crowd there are fewer steps, so that a page remains a small file.
    """
    sensed = list(moving_bodies(flight.trace, flight.stamps))
    every = 1 + len(MovingBody._fields) * sum(len(bodies) for _, bodies in sensed) // MOST_SENSED
    return [[index, _millimetres(np.array(bodies, np.float64).T)] for index, bodies in sensed[::every]]


def _millimetres(values: Floats) -> list[list[int | None]]:
    """Return the columns of `values` (m) in whole mm, None where one is unknown."""
    known = np.isfinite(values)
    whole = np.rint(1000.0 * np.where(known, values, 0.0)).astype(np.int64).astype(object)
    whole[~known] = None
    columns: list[list[int | None]] = whole.T.tolist()
    return columns


def _thinned(signal: Samples) -> tuple[list[int], list[float]]:
    """Return stamps and values of at most 2000 or so samples of a law's signal."""
    every = 1 + len(signal.stamps) // 2000
    return signal.stamps[::every].tolist(), signal.values[::every].tolist()


def _battery(trace: Trace, number: int) -> Iterator[tuple[int, int]]:
    """Yield each change of a battery in whole percent, with its stamp."""
    telemetry = trace.of("telemetry", number)
    if not len(telemetry):
        return
    percent = np.rint(100.0 * telemetry.values[:, 1]).astype(int)
    for k in np.flatnonzero(np.diff(percent, prepend=percent[0] - 1)).tolist():
        yield int(telemetry.stamps[k]), int(percent[k])


def _reports(trace: Trace, identity: str, seconds: Callable[[int], float]) -> list[list[Any]]:
    """Return time, phase, reason and formation of each change of what a process reported."""
    return [[seconds(one.stamp), one.phase, one.why, one.formation] for one in reports(trace, identity)]


def reports(trace: Trace, identity: str) -> list[Shown]:
    """Return the changes of what a process reported, by stamp; it is silent where its status is older than STALE."""
    found, series = sorted(trace.shown.get(identity, ()), key=_stamp), trace.series.get(Key("status", identity))
    if series is None or not found:
        return found
    stamps, changed = np.append(series.stamps, trace.end), [one.stamp for one in found]
    silences = []
    for k in np.flatnonzero(np.diff(stamps) > STALE).tolist():
        last, following = int(stamps[k]), int(stamps[k + 1])
        after = bisect_right(changed, last)
        silences.append(Shown(last + STALE, SILENT))
        if following < trace.end and following not in changed[after : after + 1]:
            silences.append(found[max(after - 1, 0)]._replace(stamp=following))
    return sorted([*found, *silences], key=_stamp)


def _marks(trace: Trace, flight: Sampled) -> list[Event]:
    """Return orders, stops, faults and changes of phases, by time, of the part that is shown."""
    changes = [
        (one.stamp, one.phase, pilot, one.why)
        for pilot in trace.plan.pilot.values()
        for before, one in pairwise([Shown(0, ""), *reports(trace, pilot)])
        if one.phase != before.phase
    ]
    marks = [*events(trace), *_grouped(sorted(changes))]
    begin, end = int(flight.stamps[0]), int(flight.stamps[-1])
    inside = [mark for mark in marks if begin <= mark.stamp <= end]
    return sorted(inside, key=lambda mark: (mark.stamp, mark.kind in (PHASE, RUNG)))


def _grouped(changes: Sequence[tuple[int, str, str, str]]) -> Iterator[Event]:
    """Yield a mark for the drones that changed to the same phase for the same reason at about the same time."""
    together = SECOND // 2  # ns within which drones that change to the same phase make one mark
    groups: list[tuple[str, str, int, list[str]]] = []
    newest: dict[tuple[str, str], tuple[int, list[str]]] = {}
    for stamp, phase, pilot, why in changes:
        begin, pilots = newest.get((phase, why), (stamp - together, []))
        if stamp - begin < together:
            pilots.append(pilot)
        else:
            newest[phase, why] = stamp, [pilot]
            groups.append((phase, why, *newest[phase, why]))
    for group in groups:
        yield _mark(*group)


def _mark(phase: str, why: str, stamp: int, pilots: Sequence[str]) -> Event:
    kind = RUNG if phase == SILENT or (why and phase not in ORDERLY) else PHASE
    return Event(stamp, f"{', '.join(sorted(pilots))}: {phase}" + (f" ({why})" if why else ""), kind)
