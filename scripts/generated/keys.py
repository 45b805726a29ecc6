"""The page of processes, keys and messages, from the process table, the key table and the ROS 2 definitions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, get_args

from flockwire_core.wire.keys import ANY_TIME, TABLE, Delivery, KeyRow
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import PROCESSES, Link, Process
from flockwire_core.wire.schemas import DEFINITIONS, ROS_TYPES
from flockwire_lab.faults.kinds import Fault

HEAD = """# Processes, keys and messages

<!-- made by scripts/document from core/flockwire_core/wire; change that -->

A key is `<swarm>/<owner>/<kind>`, or `<swarm>/<kind>` where all share it; it is also a ROS 2 topic name. A payload is a
ROS 2 message in CDR. [Architecture](../concepts/architecture.md) explains the most important of them.

## Processes

A process exists if the swarm file has what the second column names. The order of the rows decides who dials: of two
linked processes the lower one dials the other.

| process | exists with | link | faults that wrap it |
|---|---|---|---|
"""
_LINK = {Link.PEER: "peer", Link.ROUTER: "router", Link.DIALS: "dials"}
KEYS = """
## Keys

Quotas are messages per second and bytes per message; receivers drop and count what exceeds them
([checks](../checks.md)). That of `batch` grows with the messages of its process. A message
older than the maximum age is dropped.

| kind | message | delivery | quota | maximum age |
|---|---|---|---|---|
"""
_DELIVERY = {Delivery.STATE: "state", Delivery.EVENT: "event", Delivery.BACKGROUND: "background"}
FLOWS = """
## Who sends what to whom

These are the keys of `{file}`. The recorder receives all of them.

| key | from | to |
|---|---|---|
"""
MESSAGES = "\n## Messages\n"


def keys_page(plan: Plan, file: str) -> str:
    """Return the page, with the flows of `plan` as the example; `file` is its swarm file."""
    flows = "".join(
        f"| `{plan.text(flow.key)}` | {_names(plan, flow.publishers)} | {_names(plan, flow.subscribers)} |\n"
        for flow in plan.flows
    )
    messages = "".join(f"\n### {name}\n\n```text\n{text}\n```\n" for name, text in sorted(_own().items()))
    return (
        HEAD
        + "".join(map(_process, PROCESSES))
        + _legend(_LINK)
        + KEYS
        + "".join(map(_key, TABLE))
        + _legend(_DELIVERY)
        + FLOWS.format(file=file)
        + flows
        + MESSAGES
        + messages
    )


def _legend(names: Mapping[Any, str]) -> str:
    """Explain the words for the members of an enumeration by their values."""
    return "\n" + "".join(f"- **{name}**: {one.value}\n" for one, name in names.items())


def _process(row: Process) -> str:
    kinds = (get_args(kind.model_fields["kind"].annotation)[0] for kind in get_args(Fault) if row in kind.cores)
    faults = ", ".join(f"`{kind}`" for kind in sorted(kinds))
    return f"| `{row.kind}` | {row.only_if.rstrip(',') or 'every swarm'} | {_LINK[row.link]} | {faults} |\n"


def _key(row: KeyRow) -> str:
    limit = "none" if row.maximum_age in (None, ANY_TIME) else f"{row.maximum_age:g} s"
    kind = ROS_TYPES[row.message].replace("/msg/", "/")
    return f"| `{row.kind}` | {kind} | {_DELIVERY[row.delivery]} | {row.rate}/s, {row.largest} B | {limit} |\n"


def _names(plan: Plan, identities: tuple[str, ...]) -> str:
    return ", ".join(one for one in identities if one not in plan.recorders) or "the recorder only"


def _own() -> dict[str, str]:
    return {name.replace("/msg/", "/"): text for name, text in DEFINITIONS.items() if name.startswith("flockwire")}
