"""What the commands share: their arguments, reading files, refusing in one line with exit status 2."""

from __future__ import annotations

import os
import sys
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer
from flockwire import clock
from flockwire.loading import SwarmFileError, load_swarm, read_swarm
from flockwire.security.files import CredentialsError, default_folder
from flockwire.swarm.model import Swarm
from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR

if TYPE_CHECKING:
    from flockwire.flight.faults import Fault

ADDRESSES = "FLOCKWIRE_BY_NAME"  # set where each process has a host, or container, of its own that has its name
SwarmFile = Annotated[Path, typer.Argument(metavar="SWARM", help="The swarm file (TOML).")]
Keys = Annotated[
    Path | None,
    typer.Option(envvar="FLOCKWIRE_KEYS", help="Folder of the certificates [.flockwire/NAME/keys beside SWARM]."),
]
FaultsFile = Annotated[Path | None, typer.Option(help="What is to go wrong, and when (TOML).")]
Without = Annotated[
    list[int] | None, typer.Option(metavar="ID", help="A drone to leave on the ground; may be given again.")
]
Number = Annotated[int, typer.Argument(metavar="ID", help="The drone's id.")]


def application() -> typer.Typer:
    """Return a command line without commands; its help and its errors are plain text."""
    return typer.Typer(
        help="Distributed edge runtime for formation flight: one process per drone, on Zenoh.",
        no_args_is_help=True,
        context_settings={"help_option_names": ["-h", "--help"]},
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
    )


def refuse(reason: str) -> NoReturn:
    """End with exit status 2; each line of `reason` names what is wrong."""
    print("\n".join(f"flockwire: {line}" for line in reason.split("\n")), file=sys.stderr)
    raise typer.Exit(2)


def unwritable(out: Path, error: OSError) -> NoReturn:
    """Refuse the folder `out`; an error that is not of the system (a port in use) has a sentence of its own."""
    refuse(f"--out = {out}: cannot write there: {error.strerror}" if error.strerror else str(error))


def this_host(swarm: Swarm, host: str | None) -> str:
    """Return which of [hosts] this machine is, the first unless --host names one; refuses a name that is not there."""
    if host is not None and host not in swarm.hosts:
        refuse(f"--host = {host!r}: must be one of {sorted(swarm.hosts)} ([hosts])")
    return host or next(iter(swarm.hosts))


def refuse_endless(duration: float) -> None:
    """Refuse a --duration that is no number of seconds."""
    if not isfinite(duration):
        refuse(f"--duration = {duration}: must be a number of seconds; 0 flies until Ctrl-C")


def left_out(plan: Plan, without: list[int] | None) -> tuple[int, ...]:
    """Return the drones to leave on the ground and print what that changes, or refuse what the graph does not allow."""
    from flockwire.flight.absence import consequences, refusal  # noqa: PLC0415  (numpy)

    absent = tuple(sorted(set(without or ())))
    if cannot := refusal(plan.swarm, absent):
        refuse(cannot)
    for line in consequences(plan.swarm, absent):
        print(f"flockwire: {line}")
    return absent


def refuse_a_second_trace(out: Path) -> None:
    """Refuse a folder that has a flight's trace already."""
    try:
        check_no_trace(out)
    except FileExistsError as error:
        refuse(f"--out = {error}")


def check_no_trace(out: Path) -> None:
    """Raise FileExistsError for a folder that has a flight's trace already."""
    if os.access(out / "trace.mcap", os.F_OK):
        raise FileExistsError(f"{out}: there is a trace of another flight; name a new folder")


def load(path: Path, checked: bool = True) -> Plan:
    """Return the plan of a file's swarm, or refuse the file; an order does not wait for the rules to be `checked`."""
    try:
        return Plan(load_swarm(path) if checked else read_swarm(path), by_name=ADDRESSES in os.environ)
    except SwarmFileError as error:
        refuse(str(error))


def faults_of(path: Path | None, plan: Plan) -> tuple[Fault, ...]:
    """Return the faults of a file, none without one; or refuse it."""
    from flockwire.flight.faults import FaultFileError, load_faults  # noqa: PLC0415

    try:
        return load_faults(path, plan) if path is not None else ()
    except FaultFileError as error:
        refuse(str(error))


def warn_of(swarm: Swarm) -> None:
    """Warn when nothing protects the swarm."""
    if swarm.network.security == "none":
        print(
            "flockwire: warning: network.security = 'none': anybody who reaches a port reads and writes all",
            file=sys.stderr,
        )


def keys_folder(file: Path, plan: Plan, keys: Path | None) -> Path:
    """Return the folder of the certificates: `keys`, or that of the swarm beside its `file`."""
    return keys or default_folder(plan.swarm.name, file.parent)


def made_keys(file: Path, plan: Plan, keys: Path | None, host: str) -> Path:
    """Return the folder of the certificates as `complete_keys` does, or refuse them."""
    try:
        return complete_keys(file, plan, keys, host)
    except CredentialsError as error:
        refuse(str(error))


def complete_keys(file: Path, plan: Plan, keys: Path | None, host: str) -> Path:
    """Return the folder of the certificates, after making what it lacks where the authority's key is or may be here.

    Raises CredentialsError.
    """
    from flockwire.security.credentials import load_credentials  # noqa: PLC0415
    from flockwire.security.pki import make_keys  # noqa: PLC0415

    swarm = plan.swarm
    folder = keys_folder(file, plan, keys)
    warn_of(swarm)
    first = next(iter(swarm.hosts)) == host  # another host's keys come from the first one
    made, authority = (os.access(folder / name, os.F_OK) for name in ("ca.crt", "authority/ca.key"))
    here = (first and not made) or authority
    if swarm.network.security == "mtls":
        if here:
            _write(folder, lambda: make_keys(plan, folder, clock.utc()))
        for identity in (*plan.processes_on(host), OPERATOR.kind):
            if identity in plan.certified:
                load_credentials(folder, identity, clock.utc(), plan.issuer(identity), plan.authorities)
    return folder


def written(folder: Path, work: Any) -> Any:  # noqa: ANN401  (it passes through whatever `work` returns)
    """Do `work` on the keys in `folder`; refuse when that cannot be done."""
    try:
        return _write(folder, work)
    except CredentialsError as error:
        refuse(str(error))


def _write(folder: Path, work: Any) -> Any:  # noqa: ANN401
    """Do `work` on the keys in `folder`; raises CredentialsError when that cannot be done."""
    try:
        return work()
    except OSError as error:
        raise CredentialsError(f"{folder}: cannot write keys there: {error.strerror or error}") from None
    except ValueError as error:
        raise CredentialsError(str(error)) from None
