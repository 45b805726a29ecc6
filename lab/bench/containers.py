"""A swarm of containers for measurements: deployed, started, watched from a container of the operator, and removed."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
import tomllib
from collections.abc import Callable, Iterator
from datetime import datetime
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

import tomli_w
from flockwire_core.loading import load_swarm
from flockwire_core.wire.plan import Plan

ROOT = Path(__file__).parents[2]
IMAGE, BASE = "flockwire-test", "flockwire-base"  # as the tests have them
CLOSE = 0.1  # m from its place, of a drone in formation
NAME, WATCHER = "bench", "flockwire-bench-watcher"
WATCH = """
import json, time
from pathlib import Path
from flockwire_core.loading import load_swarm
from flockwire_core.runtime.session import Session
from flockwire_core.wire.plan import Plan
from flockwire_operator.station.operator import Operator
plan, known = Plan(load_swarm(Path("/swarm/swarm.toml")), by_name=True), {}
with Session(plan, "operator", Path("/keys")) as session:
    operator = Operator(plan, session)
    while True:
        operator.poll()
        for name, status in operator.statuses.items():
            if known.get(name) != status.stamp:
                known[name], report = status.stamp, status.report
                print(json.dumps([name, status.stamp, report.phase, report.formation_error, report.detail]), flush=True)
        time.sleep(0.02)
"""


Changes = dict[str, list[tuple[float, str, str]]]  # by pilot: s, the phase from then on, why


class Seen(NamedTuple):
    """What matters of a status: its stamp in Unix ns, the formation error in m."""

    identity: str
    stamp: int
    phase: str
    error: float
    detail: str


class Containers:
    """The containers of the folder that `flockwire deploy` wrote for `plan`."""

    def __init__(self, folder: Path, plan: Plan) -> None:
        self.runs, self.plan, self.seen = folder / "runs", plan, list[Seen]()
        self.pilots = tuple(plan.pilots.values())
        v2 = subprocess.run(["docker", "compose", "version"], capture_output=True, check=False).returncode == 0
        command = ("docker", "compose") if v2 else ("docker-compose",)
        self._compose = (*command, "--project-directory", folder, "-f", folder / "compose.yaml")
        self._ids: dict[str, str] = {}

    def up(self, *identities: str) -> None:
        """Start processes; the operator conducts a flight that lasts until it is told to land."""
        self._run("up", "-d", "--no-deps", *identities)
        for identity in identities:  # the watcher is a container of the operator too
            labels = (f"project={NAME}", f"service={identity}", "oneoff=False")
            filters = [word for label in labels for word in ("--filter", f"label=com.docker.compose.{label}")]
            self._ids[identity] = run("docker", "ps", "--all", "--quiet", *filters)

    def watch(self) -> None:
        """Take down every status from now on."""
        self._run("run", "-d", "--name", WATCHER, "--entrypoint", "python", "operator", "-c", WATCH)
        logs = subprocess.Popen(["docker", "logs", "-f", WATCHER], stdout=subprocess.PIPE, text=True)

        def read() -> None:
            for line in logs.stdout or ():
                self.seen.append(Seen(*json.loads(line)))

        threading.Thread(target=read, daemon=True).start()

    def order(self, verb: str) -> str:
        """Give an order; returns the answer."""
        return run("docker", "exec", WATCHER, "flockwire", verb, "/swarm/swarm.toml", "--keys", "/keys", check=False)

    def docker(self, verb: str, identity: str) -> str:
        """Run a docker command on the container of a process; returns what it printed."""
        return run("docker", *verb.split(), self._ids[identity])

    def state(self, identity: str) -> dict[str, Any]:
        """Return what the engine knows of the container of a process."""
        found: list[dict[str, dict[str, Any]]] = json.loads(self.docker("inspect", identity))
        return found[0]["State"]

    def newest(self, since: int = 0) -> dict[str, Seen]:
        """Return the newest status of each process, not older than 1 s, and from after `since` (Unix ns)."""
        oldest = max(since, time.time_ns() - 10**9)
        return {status.identity: status for status in self.seen[-500:] if status.stamp > oldest}

    def all_in(self, *phases: str, since: int = 0, within: float = inf) -> bool:
        """Return whether all pilots reported one of `phases` after `since`, `within` m of their places."""
        newest = self.newest(since)
        rows = [newest[pilot] for pilot in self.pilots if pilot in newest]
        return len(rows) == len(self.pilots) and all(row.phase in phases and row.error < within for row in rows)

    def in_place(self, since: int = 0) -> bool:
        """Return whether all fly the formation, close to their places, by what they reported after `since`."""
        return self.all_in("formation", since=since, within=CLOSE)

    def changes(self, since: int, end: int) -> Changes:
        """Return each pilot's changes of phase between two times, Unix ns."""
        phases: dict[str, str] = {}
        found: Changes = {}
        for status in [status for status in self.seen if status.identity in self.pilots and status.stamp < end]:
            if status.stamp > since and phases.get(status.identity, status.phase) != status.phase:
                change = ((status.stamp - since) / 1e9, status.phase, status.detail)
                found.setdefault(status.identity, []).append(change)
            phases[status.identity] = status.phase
        return found

    def started(self, identity: str) -> int:
        """Return when the container of a process was started, Unix ns."""
        text = self.state(identity)["StartedAt"]
        whole = datetime.fromisoformat(f"{text[:19]}+00:00")
        return int(whole.timestamp()) * 10**9 + int(text[20:-1].ljust(9, "0"))

    def remove(self) -> None:
        """Leave no container and no network behind."""
        run("docker", "rm", "--force", WATCHER, check=False)
        self._run("down", "--timeout", "5", "--remove-orphans", check=False)

    def _run(self, *words: object, check: bool = True) -> str:
        return run(*self._compose, *words, check=check, FLOCKWIRE_IMAGE=IMAGE, DURATION="0")


@contextlib.contextmanager
def containers(swarm_file: Path, changes: dict[str, dict[str, object]]) -> Iterator[Containers]:
    """Deploy and start a swarm with `changes` to tables of its file; none of its containers is left at the end."""
    run(ROOT / "scripts/image", FLOCKWIRE_IMAGE=IMAGE, BASE=BASE)
    with tempfile.TemporaryDirectory() as temporary:
        folder, file = Path(temporary), Path(temporary) / "bench.toml"
        table: dict[str, Any] = tomllib.loads(swarm_file.read_text()) | {"name": NAME}
        for name, change in changes.items():
            table[name] |= change
        file.write_text(tomli_w.dumps(table))
        line = (
            sys.executable,
            "-m",
            "flockwire_operator",
            "deploy",
            file,
            "--target",
            "compose",
            "--keys",
            folder / "keys",
        )
        run(*line, "--out", folder / "swarm")
        made = Containers(folder / "swarm", Plan(load_swarm(file)))
        try:
            made.up(*made.plan.started)
            made.watch()
            yield made
        finally:
            made.remove()


def run(*words: object, check: bool = True, **environment: str) -> str:
    """Run a command; returns all that it printed. Raises RuntimeError when it fails and is not to."""
    done = subprocess.run([str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          env={**os.environ, **environment}, check=False)  # fmt: skip
    if check and done.returncode:
        raise RuntimeError(f"{' '.join(map(str, words))}: {done.stdout[-2000:]}")
    return done.stdout.strip()


def until(met: Callable[[], bool], seconds: float, what: str, steady: float = 0.0) -> int:
    """Wait until it is so, and stays so for `steady` s; returns since when, Unix ns. Raises TimeoutError."""
    deadline, since = time.monotonic() + seconds, 0
    while time.monotonic() < deadline or since:
        now = time.time_ns()
        since = (since or now) if met() else 0
        if since and now - since >= steady * 1e9:
            return since
        time.sleep(0.02)
    raise TimeoutError(f"not within {seconds:.0f} s: {what}")
