"""Commands that run one process of a swarm, as systemd and compose start them: one for each kind of process.

The standard library's argparse reads their arguments: a drone's host has no other package for it.
"""

from __future__ import annotations

import os
from argparse import SUPPRESS, ArgumentParser, ArgumentTypeError, Namespace, RawDescriptionHelpFormatter
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from flockwire_core import clock
from flockwire_core.objects import load_object
from flockwire_core.runtime.standard_streams import unblocked
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import PROCESSES, Process
from flockwire_lab.faults.targets import WRAPPED

from flockwire_operator.cli.inputs import faults_of, load, planned, refuse, refuse_a_second_trace, refused
from flockwire_operator.station.flown import OtherFlightError, as_flown, flown, flown_by
from flockwire_operator.station.folders import keys_folder

if TYPE_CHECKING:
    from flockwire_core.process.cores import Core, Start
    from flockwire_core.runtime.job import Job

KINDS = {row.kind: row for row in PROCESSES if row.started}


class _Help(RawDescriptionHelpFormatter):
    """Starts with "Usage:", like the help of all other commands."""

    def add_usage(self, usage, actions, groups, prefix=None) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
        super().add_usage(usage, actions, groups, prefix or "Usage: ")


def run(kind: str, arguments: Sequence[str]) -> int:
    """Run one process of that kind to its end; returns its exit status. Raises SystemExit for bad arguments."""
    patience = 1.0  # s that an ended process waits for a paused terminal
    row = KINDS[kind]
    given = parser_of(row).parse_args(arguments)
    with unblocked(patience):
        return _serve(row, given)


def parser_of(row: Process) -> ArgumentParser:
    """Return the argument parser of one kind of process."""
    parser = ArgumentParser(f"flockwire {row.kind}", description=row.help, formatter_class=_Help, allow_abbrev=False)
    parser.set_defaults(id=None, out=Path(), dated=False, protocol=None, trace=None, faults=None, took_off=None)
    parser.add_argument("swarm", metavar="SWARM", type=Path, help="The swarm file (TOML).")
    if row.numbered or row.pilot:
        most = None if row.numbered else "?"
        parser.add_argument("id", metavar="ID", nargs=most, type=int, help="The drone's id.")
    keys = os.environ.get("FLOCKWIRE_KEYS")
    parser.add_argument(
        "--keys",
        type=Path,
        default=Path(keys) if keys else None,
        help="Folder of the certificates [FLOCKWIRE_KEYS, or .flockwire/NAME/keys beside SWARM].",
    )
    if row.records:
        parser.add_argument("--out", type=Path, default=Path("runs/recording"), help="Folder for trace.mcap.")
        parser.add_argument(
            "--dated",
            action="store_true",
            help="Use a folder named by the time below OUT; continue one that a crash interrupted.",
        )
    if row.standalone:
        parser.add_argument(
            "--protocol",
            metavar="P",
            help="The protocol: natnet, vrpn, qualisys, ros. Without the swarm: bodies are at the starts.",
        )
    if row.replay:
        parser.add_argument("--trace", type=Path, help="Show this trace of the swarm, with its clock, instead of it.")
        parser.add_argument("--pace", type=_pace, default=1.0, help="How many times as fast as it was recorded [1].")
    if row in WRAPPED or row.records:  # the recorder marks them in the trace
        parser.add_argument("--faults", type=Path, help="The faults to inject (TOML).")
        parser.add_argument("--took-off", type=int, help=SUPPRESS)  # time 0 of faults, Unix ns
    return parser


def _serve(row: Process, given: Namespace) -> int:
    from flockwire_core.runtime.ending import LIFELINE  # noqa: PLC0415  (asyncio)
    from flockwire_core.runtime.job import Job, serve  # noqa: PLC0415  (zenoh)

    swarm = given.swarm
    child = LIFELINE in os.environ  # a child of `up`, also after a restart, flies the swarm that took off
    flying = as_flown(swarm) if child else None
    plan = load(swarm) if flying is None else planned(flying.swarm)
    if given.protocol is not None:
        return _alone(row, plan, given.protocol)
    if given.trace is not None:
        return _replayed(row, plan, given.trace, given.pace)
    identity = _identity(plan, row, given.id)
    out = _out(given, plan, row.records and not child)  # a restarted child continues in the same flight
    folder = keys_folder(swarm, plan, given.keys)
    what = flying or flown_by(plan.swarm, swarm, folder)
    with ExitStack() as stack:
        with suppress(OtherFlightError):  # the file was changed in flight, and this process was started by hand
            stack.enter_context(flown(swarm, what))
        job = Job(plan, identity, folder, what.toml, out)
        return serve(job if given.faults is None else _with_faults(job, given.faults, given.took_off))


def _with_faults(job: Job, file: Path, took_off: int | None) -> Job:
    """Return `job` with its core wrapped by the faults of a file, which are counted from `took_off`, Unix ns."""
    from flockwire_core.process.cores import make_core  # noqa: PLC0415  (few flights have faults)
    from flockwire_lab.faults.faulty_core import faulty  # noqa: PLC0415
    from flockwire_lab.faults.file import notes  # noqa: PLC0415

    faults = faults_of(file, job.plan)

    def make(start: Start) -> Core:
        return faulty(make_core(start), faults, job.plan, job.identity, took_off)

    return replace(job, make_core=make, notes=notes(faults))


def _out(given: Namespace, plan: Plan, begins: bool) -> Path:
    """Return the folder of the trace; refuse one that has another trace if a recording `begins`."""
    out: Path = given.out
    if not (given.dated or begins):
        return out
    from flockwire_recorder.folders import dated_folder, same_flight  # noqa: PLC0415  (only a recorder needs it)

    if given.dated:
        with refused(cannot=f"--out = {out}: cannot read it"):
            return dated_folder(out, plan.swarm, clock.local())
    if not same_flight(out, plan.swarm, clock.utc()):
        refuse_a_second_trace(out)
    return out


def _alone(row: Process, plan: Plan, protocol: str) -> int:
    """Run a process without its swarm."""
    if protocol not in plan.swarm.gateway.twins:
        refuse(f"--protocol = {protocol!r}: must be one of {', '.join(plan.swarm.gateway.twins)}")
    with suppress(KeyboardInterrupt), refused(bad=OSError):
        load_object(row.standalone)(plan.swarm, protocol)
    return 0


def _pace(text: str) -> float:
    fastest = 100.0  # times the recorded pace
    try:
        pace = float(text)
    except ValueError:
        pace = 0.0
    if not 0.0 < pace <= fastest:
        raise ArgumentTypeError(f"{text!r}: must be a number above 0, at most {fastest:g}")
    return pace


def _replayed(row: Process, plan: Plan, trace: Path, pace: float) -> int:
    """Show a trace, until it is interrupted."""
    _identity(plan, row, None)
    try:
        with suppress(KeyboardInterrupt):
            load_object(row.replay)(plan, trace, pace)
    except ValueError as error:
        refuse(f"--trace = {error}")
    except OSError as error:
        refuse(f"--trace = {trace}: cannot read it: {error.strerror or error}")
    return 0


def _identity(plan: Plan, row: Process, number: int | None) -> str:
    members = {plan.members[identity].drone: identity for identity in plan.of(row)}
    if not members:
        refuse(f"{plan.swarm.name} has no {row.kind}: only a swarm with {row.only_if} has one")
    if number is not None or len(members) > 1:
        if number not in members:
            refuse(f"ID = {number}: must be one of {list(members)}")
        return members[number]
    return next(iter(members.values()))
