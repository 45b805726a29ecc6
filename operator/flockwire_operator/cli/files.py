"""Commands for a swarm before it flies: `new`, `init`, `check`, `convert`, `deploy`."""

from __future__ import annotations

import asyncio
import sys
from enum import StrEnum
from importlib.metadata import packages_distributions
from ipaddress import IPv4Network
from keyword import iskeyword
from pathlib import Path
from typing import TYPE_CHECKING, Annotated
from zipfile import BadZipFile

import typer
from flockwire_core import clock
from flockwire_core.own_law import law_check
from flockwire_core.wire.plan import Plan

from flockwire_operator.cli.arguments import AsJson, Keys, SwarmFile
from flockwire_operator.cli.inputs import finite, load, refuse, refused
from flockwire_operator.station.folders import keys_folder, renew_keys
from flockwire_operator.station.initial import write_law, write_swarm

if TYPE_CHECKING:
    from flockwire_operator.station.conversion import Track

app = typer.Typer()
Target = StrEnum("Target", ["COMPOSE", "SYSTEMD", "ANSIBLE"])  # where a swarm is deployed to


@app.command()
def new(name: Annotated[str, typer.Argument(metavar="NAME", help="The law's name, such as my_law.")]) -> None:
    """Write a first law of your own, its swarm file and its test into this folder."""
    if not (name.isascii() and name.isidentifier() and name[0].isalpha()) or iskeyword(name):
        refuse(f"NAME = {name}: must be a name in Python, of letters, digits and _, such as my_law")
    if name in sys.stdlib_module_names or name in packages_distributions():
        refuse(f"NAME = {name}: is a module that others import; name another one")
    try:
        law, swarm, test = write_law(Path(), name)
    except FileExistsError as error:
        refuse(f"NAME = {name}: {error} exists; name a new one")
    except OSError as error:
        refuse(f"NAME = {name}: cannot write here: {error.strerror}")
    print(f"flockwire: {law}, {swarm}, {test}; next: flockwire check {swarm}, flockwire sim {swarm}")
    print(f"  the test flies it too: python -m pip install pytest, pytest {test}")


@app.command()
def init(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The swarm file to write.")] = Path("swarm.toml"),
    drones: Annotated[int, typer.Option(min=2, max=200, help="The number of drones, with the leader.")] = 4,
    ideal: Annotated[bool, typer.Option("--ideal", help="A perfect world: no noise, no latency, no lag.")] = False,
) -> None:
    """Write a swarm file with comments, and a schema for editors beside it; its simulated world is a laboratory's."""
    if file.exists():
        refuse(f"FILE = {file}: exists; name a new one")
    with refused(cannot=f"FILE = {file}: cannot write there"):
        write_swarm(file, drones, ideal)
    print(
        f"flockwire: {file}: {drones} drones; next: flockwire check {file}, flockwire sim {file}, flockwire up {file}"
    )


@app.command()
def check(
    swarm: SwarmFile,
    duration: Annotated[
        float, typer.Option(min=0.0, callback=finite, help="Seconds of flight to predict; 0: no end.")
    ] = 40.0,
    live: Annotated[bool, typer.Option("--live", help="Check instead whether the running swarm may take off.")] = False,
    keys: Keys = None,
    as_json: AsJson = False,
) -> None:
    """Validate a swarm file; print its graph, observer bounds, formations, links, and predicted problems in flight."""
    from flockwire_core.security.pki import expiring  # noqa: PLC0415

    from flockwire_operator.station.check import describe  # noqa: PLC0415  (numpy, whose threads it limits)
    from flockwire_operator.station.prediction import predicted  # noqa: PLC0415
    from flockwire_operator.station.warnings import warnings  # noqa: PLC0415

    plan = load(swarm)
    if live:
        _check_live(plan, keys_folder(swarm, plan, keys), as_json)
        return
    checked = law_check(plan.swarm)
    if checked[0]:
        refuse("\n".join(f"{swarm}: control.law = {plan.swarm.control.law!r}: {one}" for one in checked[0]))
    expired = expiring(plan, keys_folder(swarm, plan, keys), clock.utc())
    if as_json:
        from flockwire_operator.station.answers import description, text  # noqa: PLC0415

        print(text(description(plan, [*warnings(plan.swarm), *predicted(plan.swarm, duration), *expired])))
    else:
        print(describe(plan, duration, checked))
        for line in expired:
            print(f"warning: {line}")


def _check_live(plan: Plan, keys: Path, as_json: bool) -> None:
    """Print the state of the running swarm, and end if it is not ready."""
    from flockwire_core.runtime.session import RouterAbsentError  # noqa: PLC0415  (zenoh)

    from flockwire_operator.station.answers import text  # noqa: PLC0415
    from flockwire_operator.station.live_check import findings, look, table  # noqa: PLC0415

    try:
        with refused():
            found = list(findings(plan, asyncio.run(look(plan, keys))))
    except RouterAbsentError:
        refuse(f"the router at {plan.endpoints[plan.routers[0]]} does not answer")
    print(text({"checks": [line._asdict() for line in found]}) if as_json else "\n".join(table(found)))
    if failed := [line for line in found if line.remedy]:
        refuse(f"not ready: {len(failed)} of {len(found)} checks failed", 1)


@app.command()
def convert(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Trajectories, one drone or one show each.")],
    out: Annotated[Path, typer.Option(help="The key frames to write.")] = Path("frames.csv"),
    rate: Annotated[float, typer.Option(min=0.1, max=100.0, help="Key frames per second, at most.")] = 10.0,
    leader: Annotated[bool, typer.Option("--leader", help="Write the path of the leader instead.")] = False,
) -> None:
    """Write key frames from trajectories of Crazyswarm (CSV), Skybrush (.skyc, CSV) or in TUM's format."""
    from flockwire_operator.station.conversion import key_frames  # noqa: PLC0415

    found = [track for file in files for track in _tracks(file, rate)]
    if leader and len(found) != 1:
        refuse(f"--leader: one trajectory is the leader's, there are {len(found)}")
    if out.exists():
        refuse(f"--out = {out}: exists; name a new one")
    with refused(out):
        out.write_text(key_frames(found, found[0][0][1] if leader else (0.0, 0.0, 0.0)), encoding="utf-8")
    frames = f'kind = "key_frames"\nfile = "{out.name}"'
    still = '[leader]   # a point that stands still, from which places count\nkind = "virtual"\nstart = [0.0, 0.0, 0.0]'
    still += '\n[leader.trajectory]\nkind = "constant"\nvelocity = [0.0, 0.0, 0.0]'
    print(f"flockwire: {out}: {len(found)} drones, {max(track[-1][0] for track in found):.1f} s; in the swarm file:\n")
    print(f"[leader.trajectory]\n{frames}" if leader else f"[formation]\n{frames}\n{still}")


def _tracks(file: Path, rate: float) -> list[Track]:
    """Return the trajectories in a file, or refuse it."""
    from flockwire_operator.station.conversion import tracks  # noqa: PLC0415

    try:
        return list(tracks(file, rate))
    except (OSError, ValueError, RecursionError, BadZipFile) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        refuse(f"FILE = {file}: {reason or 'cannot be read'}")


@app.command()
def deploy(
    swarm: SwarmFile,
    target: Annotated[Target, typer.Option(help="The system that starts the processes.")] = Target.COMPOSE,
    out: Annotated[Path | None, typer.Option(help="The folder to write [deploy/NAME].")] = None,
    keys: Keys = None,
    wheels: Annotated[
        Path, typer.Option(help="The wheels for the hosts, made by scripts/wheels (systemd, ansible).")
    ] = Path("dist/wheels"),
    subnets: Annotated[
        str, typer.Option(metavar="A.B.C.D/N", help="The address range for the containers' networks (compose).")
    ] = "",
) -> None:
    """Write containers or services of a swarm, with the keys of each process."""
    from flockwire_deploy.bundle import write_bundles  # noqa: PLC0415  (jinja2)
    from flockwire_deploy.compose import obstacle, write_compose  # noqa: PLC0415
    from flockwire_deploy.files import refuse_other_keys  # noqa: PLC0415

    plan = load(swarm)
    if plan.swarm.network.security == "none":
        refuse("network.security = 'none': is only for measurements on one machine, with `up`; remove it to deploy")
    if plan.swarm.control.elsewhere:
        refuse(f"control.law = {plan.swarm.control.law!r}: is a program of this machine; fly it with `flockwire up`")
    folder, held = out or Path("deploy") / plan.swarm.name, keys_folder(swarm, plan, keys)
    with refused(folder):
        within = _range(subnets)
        refuse_other_keys(plan, held)
        renew_keys(plan, held)
        places = (plan, swarm, held, folder)
        if target is Target.COMPOSE:
            step = write_compose(*places, within)
        else:
            step = write_bundles(*places, wheels, playbook=target is Target.ANSIBLE)
    print(f"flockwire: {folder}: {plan.swarm.name}, for {target}; next: {step}")
    if target is Target.COMPOSE and (line := obstacle()):
        print(f"flockwire: warning: {line}", file=sys.stderr)


def _range(text: str) -> IPv4Network | None:
    try:
        return IPv4Network(text) if text else None
    except ValueError as error:
        refuse(f"--subnets = {text!r}: must be a range of IPv4 addresses like 10.224.0.0/12: {error}")
