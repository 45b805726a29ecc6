"""What `check`, `status` and `tracker` answer with --json: stable names, SI units, null where there is no figure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from flockwire_core.control.convergence import convergence
from flockwire_core.domain.time import SECOND
from flockwire_core.swarm.formation_rules import survey_of
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status
from pydantic_core import to_json

Answer = dict[str, Any]


def text(answer: Answer) -> str:
    """Return an answer as JSON; a number without a value is null."""
    return to_json(answer, indent=2, inf_nan_mode="null").decode()


def _observer(swarm: Swarm) -> Answer | None:
    """Return what Lemma 3 proves; nothing without a leader, or with several."""
    if swarm.sole_leader is None:
        return None
    observer = swarm.observer
    bound = convergence(swarm.topology, observer.gain, observer.exponent, swarm.reference.input_bound)
    return {"lambda_min": bound.lambda_min, "theta": bound.margin, "settling_time": bound.settling_time_bound}


def description(plan: Plan, warnings: Iterable[str]) -> Answer:
    """Return what `check` finds in a sound swarm file."""
    swarm = plan.swarm
    graph, depths = swarm.topology, swarm.topology.depths()
    surveys = {name: survey_of(swarm, name) for name in swarm.formation_names}
    return {
        "name": swarm.name,
        "leaders": {str(i): leader.kind for i, leader in swarm.leading.items()},
        "law": swarm.control.law,
        "followers": [
            {"id": i, "from": {str(j): weight for j, weight in graph.neighbours(i).items()}, "hops": depths.get(i)}
            for i in swarm.followers
        ],
        "observer": _observer(swarm),
        "formations": [
            {"name": name, "kind": swarm.formation_table(name).kind, "fastest": survey.max_speed}
            | {"tightest": min(survey.min_distance, survey.min_distance_leader)}
            for name, survey in surveys.items()
        ],
        "processes": list(plan.started),
        "warnings": list(warnings),
    }


def state(plan: Plan, statuses: Mapping[str, Status], now: int) -> Answer:
    """Return the state of each process at `now` (Unix ns); null without a status."""
    found = {identity: statuses.get(identity) for identity in plan.started}
    processes = {identity: None if status is None else _process(status, now) for identity, status in found.items()}
    return {"name": plan.swarm.name, "time": now / SECOND, "processes": processes}


def _process(status: Status, now: int) -> Answer:
    report = status.report
    flown = report.mission if report.mission is not None and report.mission.in_formation else None
    return {
        "age": (now - status.stamp) / SECOND,
        "phase": report.phase,
        "detail": report.line,
        "formation": None if flown is None else flown.formation,
        "position": report.position,
        "battery": _known(report.battery),
        "formation_error": _known(report.formation_error),
        "pose_age": _known(report.pose_age),
        "links": list(status.links),
        "rejected": sum(count for _, count in status.rejected),
        "refused": status.refused,
    }


def _known(figure: float) -> float | None:
    return None if figure < 0.0 else figure
