"""Coverage by what traces show: how many flights had each event.

An event is a change of a phase, the code of a reason, an order, a count of what was rejected, a kind of key.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain

from flockwire_analysis.observed import Shown
from flockwire_analysis.recorded import Trace
from flockwire_core.pilot.phases import transitions
from flockwire_core.pilot.reactions import TABLE


def events(trace: Trace) -> dict[str, int]:
    """Return how often each event happened in a flight."""
    found = Counter[str](f"order: {order.verb}" for order in trace.orders)
    found["order: stop"] += len(trace.stops)
    found["order: beside another one"] += sum(bool(one.unnumbered) for one in chain(*trace.histories.values()))
    found.update(f"key: {key.kind}" for key, series in trace.series.items() if len(series))
    pilots = set(trace.plan.pilot.values())
    for identity, changes in trace.shown.items():
        found.update(_reported("pilot" if identity in pilots else identity, changes))
    for name, count in chain(*(process.last.report.counts for process in trace.vitals)):
        found[f"count: {name}"] += count
    return dict(sorted((+found).items()))


def _reported(who: str, changes: Sequence[Shown]) -> Iterator[str]:
    """Yield the changes of phases that a process reported, and the codes of reasons in each."""
    phase = ""
    for change in changes:
        if phase and change.phase != phase:
            yield f"{who}: {phase} to {change.phase}"
        phase = change.phase
        yield from (f"{who}: {phase}, {code}" for code in change.codes)


def table(flights: Iterable[Mapping[str, int]]) -> Iterator[str]:
    """Yield, line by line, how many flights had each event; then what no pilot did: transitions and reactions."""
    count, reached, times = 0, Counter[str](), Counter[str]()
    for flight in flights:
        count += 1
        reached.update(flight.keys())
        times.update(flight)
    yield f"{'event':80}{'flights':>9}{'times':>11}"
    yield from (f"{event:80}{reached[event]:>9}{times[event]:>11}" for event in sorted(reached))
    yield f"{len(reached)} events in {count} flights"
    yield from (f"never: {event}" for event in _never(reached))


def _never(reached: Mapping[str, int]) -> Iterator[str]:
    """Yield the transitions of pilots, and the reactions, that were not reached."""
    named = {f"pilot: {before} to {row.after}" for row in transitions() for before in row.before - {row.after}}
    yield from sorted(named - reached.keys())
    codes = {event.rpartition(", ")[2] for event in reached}
    yield from (row.code for row in TABLE if row.text and row.code not in codes)
