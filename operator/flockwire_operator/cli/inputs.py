"""Inputs of commands: swarm files, faults, folders, keys. A bad one gives a line and exit status 2."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from itertools import count
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from flockwire_core import clock
from flockwire_core.loading import SwarmFileError, load_swarm, read_swarm
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.wording import InputError, meant, printable
from flockwire_core.wire.plan import Plan

from flockwire_operator.station.flown import Flown, as_flown
from flockwire_operator.station.folders import check_no_trace, complete_keys, keys_folder

if TYPE_CHECKING:
    from flockwire_lab.faults.file import Unable
    from flockwire_lab.faults.kinds import Fault

ADDRESSES = "FLOCKWIRE_BY_NAME"  # set if each process has its own host, or container, of its name


def refuse(reason: str, status: int = 2) -> NoReturn:
    """End with that exit status, 2 for a bad input, 1 for a failure; each line of `reason` names a problem."""
    print("\n".join(f"flockwire: {line}" for line in printable(reason).split("\n")), file=sys.stderr)
    raise SystemExit(status)


@contextmanager
def refused(
    out: Path | None = None, cannot: str = "", bad: type[Exception] | tuple[type[Exception], ...] = InputError
) -> Iterator[None]:
    """Refuse a `bad` input, and at an OSError the folder `out`, or with what `cannot` be done, if there is one of them.

    An OSError that is not the system's (a port in use) has its own sentence.
    """
    cannot = cannot or ("" if out is None else f"--out = {out}: cannot write there")
    try:
        yield
    except bad as error:
        refuse(str(error))
    except OSError as error:
        if not cannot:
            raise
        refuse(f"{cannot}: {error.strerror}" if error.strerror else str(error))


def this_host(swarm: Swarm, host: str | None) -> str:
    """Return this machine's name in [hosts], the first unless --host names one; refuses an unknown name."""
    if host is not None and host not in swarm.hosts:
        refuse(f"--host = {host!r}: must be one of {sorted(swarm.hosts)} ([hosts]){meant(host, swarm.hosts)}")
    return host or next(iter(swarm.hosts))


def finite(duration: float | None) -> float | None:
    """Return the value of --duration; refuse one that is not a number of seconds."""
    if duration is not None and not isfinite(duration):
        refuse(f"--duration = {duration}: must be a finite number of seconds")
    return duration


def refuse_unused(what: str, options: Mapping[str, object]) -> None:
    """Refuse those of the `options`, by name, that are given, because they have no effect with `what`."""
    if given := [option for option, value in options.items() if value]:
        refuse("\n".join(f"{option}: has no effect with {what}; remove it" for option in given))


def own_folder(out: Path | None, name: str) -> Path:
    """Return `out`, or a new folder runs/NAME-TIME that no other command has, even one of the same second."""
    if out is not None:
        return out
    folder = first = Path("runs") / f"{name}-{clock.local():%Y%m%d-%H%M%S}"
    numbers = count(2)
    while True:
        with refused(folder), suppress(FileExistsError):
            folder.mkdir(parents=True)
            return folder
        folder = first.with_name(f"{first.name}-{next(numbers)}")


def trace_folder(out: Path | None, name: str) -> Path:
    """Return the folder as `own_folder` does; refuse one that already has a trace."""
    folder = own_folder(out, name)
    refuse_a_second_trace(folder)
    return folder


def refuse_a_second_trace(out: Path) -> None:
    """Refuse a folder that already has a trace."""
    try:
        check_no_trace(out)
    except FileExistsError as error:
        refuse(f"--out = {error}")


def load(path: Path, checked: bool = True) -> Plan:
    """Return the plan of a file's swarm, or refuse the file; for an order the rules are not `checked`."""
    if (flying := as_flown(path)) is not None:
        clock.share(flying.epoch)  # this host's clock may have been set since then
    with refused():
        return planned(load_swarm(path) if checked else read_swarm(path))


def load_flying(file: Path, keys: Path | None) -> tuple[Plan, Path]:
    """Return the plan and keys of the swarm that flies by `file`, as it took off.

    If nothing flies by it on this machine, it reads the file, or refuses it.
    """
    flying = as_flown(file)
    if flying is None:
        plan = load(file, checked=False)
        return plan, keys_folder(file, plan, keys)
    clock.share(flying.epoch)
    if how := _changed(file, flying):
        print(f"flockwire: {file}: {how}; the order is for {flying.swarm.name!r}, as it took off", file=sys.stderr)
    return planned(flying.swarm), keys or flying.keys_folder


def _changed(file: Path, flying: Flown) -> str:
    """Return how `file` differs from the flying swarm, empty if it does not."""
    try:
        return "" if read_swarm(file).model_dump() == flying.swarm.model_dump() else "has changed since take-off"
    except SwarmFileError:
        return "cannot be read any more"


def planned(swarm: Swarm) -> Plan:
    """Return the plan of a swarm on this machine."""
    return Plan(swarm, by_name=ADDRESSES in os.environ)


def faults_of(path: Path | None, plan: Plan, *unable: Unable) -> tuple[Fault, ...]:
    """Return the faults of a file as `load_faults` does, empty without one; or refuse it."""
    if path is None:
        return ()
    from flockwire_lab.faults.file import load_faults  # noqa: PLC0415  (0.3 MB)

    with refused():
        return load_faults(path, plan, *unable)


def made_keys(file: Path, plan: Plan, keys: Path | None, host: str) -> Path:
    """Return the folder of the certificates as `complete_keys` does, or refuse them."""
    with refused():
        return complete_keys(file, plan, keys, host)
