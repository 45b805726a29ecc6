"""The consensus example as a program in C++ and in Octave, and events by a program, fly as the laws in Python do."""

from __future__ import annotations

import shutil
import socket
import struct
import subprocess
import threading
import tomllib
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from flockwire_core.domain.vector import ZERO, Vector
from flockwire_core.law import Decision, Information, LawSettings, Observation, Pace, Sense
from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.model import Swarm
from flockwire_lab.world import World
from ports import free_port
from waiting import wait_until

FOLDER = Path(__file__).parents[2] / "laws/elsewhere"
LONG = 60.0  # s until a program serves


def flown(control: dict, file: Path = FOLDER / "consensus.toml") -> np.ndarray:
    """Return the true positions of all drones, m, in the order in which they were published."""
    table = tomllib.loads(file.read_text()) | {"control": control, "folder": str(FOLDER)}
    found: list[tuple[float, float, float]] = []

    def take(published):
        if published.key.kind == "truth":
            found.append(published.sample.message().position)

    outcome = World(parse_swarm(table, "test.toml"), 1, 12.0, tap=take).run()
    assert outcome.failure == ""
    return np.array(found)


def program(name: str, folder: Path) -> list[str]:
    """Return the command of an example, or skip the test."""
    needed = {"consensus.cpp": "g++", "consensus.m": "octave-cli"}[name]
    if shutil.which(needed) is None:
        pytest.skip(f"{needed} is not installed")
    if name.endswith(".m"):
        if subprocess.run([needed, "-q", "--eval", "pkg load sockets"], capture_output=True, check=False).returncode:
            pytest.skip("octave has no package sockets (Debian: octave-sockets)")
        return [needed, "-q", str(FOLDER / name)]
    binary = folder / "consensus"
    subprocess.run([needed, "-O2", "-Wall", "-Wextra", "-Werror", "-o", binary, FOLDER / name], check=True)
    return [str(binary)]


def is_served(port: int) -> bool:
    with socket.socket() as one:
        return one.connect_ex(("127.0.0.1", port)) == 0


@pytest.mark.long
@pytest.mark.parametrize("name", ["consensus.cpp", "consensus.m"])
def test_it_flies_as_the_law_in_python(name, tmp_path):
    information = tomllib.loads((FOLDER / "consensus.toml").read_text())["control"]["information"]
    port = free_port()
    with subprocess.Popen([*program(name, tmp_path), str(port)], cwd=tmp_path) as process:
        try:
            wait_until(lambda: is_served(port), LONG)
            elsewhere = flown({"law": f"tcp:{port}", "parameters": {"gain": 1.0}, "information": information})
        finally:
            process.kill()
    here = flown({"law": "consensus", "parameters": {"gain": 1.0}})
    assert elsewhere.shape == here.shape
    assert np.abs(elsewhere - here).max() < 1e-9


def received(end: socket.socket) -> np.ndarray | None:
    """Return the next frame, None at the end of the connection."""
    head = end.recv(8, socket.MSG_WAITALL)
    return np.frombuffer(end.recv(8 * struct.unpack("<II", head)[0], socket.MSG_WAITALL)) if head else None


def by_events(first: np.ndarray) -> Iterator[list[float]]:
    """Yield the decisions of law 10b (facts of docs/law_elsewhere.md alone); each is sent the observation."""
    count, x, decision = int(first[7]), None, []
    weights, (c0, c1, alpha) = first[8 + count : 8 + 2 * count], first[9 + 3 * count :]
    while True:
        seen = yield decision
        heard = seen[14:].reshape(count, 8)[:, 3:]  # h_i - h_j; number of the message, its age, x_j
        decision = [seen[0], 0.0, 0.0, 0.0, np.nan]
        if not seen[1] or not seen[10]:
            x = None
            continue
        q = seen[11:14] - seen[4:7]
        event = x is None or np.linalg.norm(x - q) > c0 + c1 * np.exp(-alpha * seen[2])
        x = q if x is None else x
        pull = sum((w * (one[2:] - x) for w, one in zip(weights, heard, strict=True) if one[0]), np.zeros(3))
        decision = [seen[0], *(seen[7:10] + pull), np.nan, *(q if event else ())]
        x = q if event else x


class Round(NamedTuple):
    k: float
    x: Vector


class Averaging:
    """Averages the neighbours' x round by round, a program's part as well: x+ = x + 0.3 sum a_ij (x_j − x)."""

    information = Information(own=Sense.POSITION, message=Round, pace=Pace.ROUND, directed=False)

    def __init__(self, settings: LawSettings | dict[int, float]) -> None:
        self.weights = settings if isinstance(settings, dict) else settings.neighbours
        self.heard, self.x, self.k = defaultdict[float, dict[int, np.ndarray]](dict), None, 0.0

    def step(self, observation: Observation) -> Decision:
        news = [(one.number, one.content) for one in observation.news]
        if observation.place is None or observation.position is None:
            return Decision(*self.of(None, news))
        return Decision(*self.of(np.array(observation.position), news))

    def of(self, own: np.ndarray | None, news: list[tuple[int, Round]]) -> tuple[Vector, Round | None]:
        for number, (k, x) in news:
            self.heard[k][number] = np.array(x)
        if own is None:
            return ZERO, None
        begins, heard = self.x is None, self.heard[self.k]
        if begins:
            self.x = own
        elif begins := heard.keys() >= self.weights.keys():
            self.x = self.x + 0.3 * sum(self.weights[j] * (heard[j] - self.x) for j in sorted(heard))
            self.k += 1.0
        return tuple(0.3 * (self.x - own)), Round(self.k, tuple(self.x)) if begins else None


def by_rounds(first: np.ndarray) -> Iterator[list[float]]:
    """Yield the decisions of Averaging; each is sent the observation."""
    count, decision = int(first[7]), []
    law = Averaging(dict(zip(map(int, first[8:]), first[8 + count : 8 + 2 * count], strict=False)))
    while True:
        seen = yield decision
        news = seen[14 + 9 * count :]  # after the own position; h_i - h_j, number, age and content of each newest one
        assert news.size == 1 + 6 * news[0]
        told = [(int(one[0]), Round(one[2], one[3:])) for one in news[1:].reshape(-1, 6)]
        command, message = law.of(seen[11:14] if seen[1] and seen[10] else None, told)
        decision = [seen[0], *command, np.nan, *((message.k, *message.x) if message else ())]


def serve(door: socket.socket, program: Callable[[np.ndarray], Iterator[list[float]]]) -> None:
    """Serve the law of each connection."""

    def one(end: socket.socket) -> None:
        with end:
            law = program(received(end))
            next(law)
            while (seen := received(end)) is not None:
                decision = law.send(seen)
                end.sendall(struct.pack(f"<II{len(decision)}d", len(decision), 0, *decision))

    while True:
        try:
            end = door.accept()[0]
        except OSError:
            return
        threading.Thread(target=one, args=(end,), daemon=True).start()


@pytest.mark.parametrize(
    ("law", "parameters", "told", "program"),
    [
        ("event_triggered", {"c0": 0.01, "c1": 0.3, "alpha": 0.3}, {"message": 3, "pace": "event"}, by_events),
        (f"{__file__}:Averaging", {}, {"message": 4, "pace": "round"}, by_rounds),
    ],
)
def test_messages_fly_as_those_of_the_law_in_python(law, parameters, told, program, tmp_path):
    file, information = FOLDER.parent / "examples/event_triggered.toml", {"own": ["position"], "directed": False}
    path = tmp_path / "door"
    with socket.socket(socket.AF_UNIX) as door:
        door.bind(str(path))
        door.listen(16)
        threading.Thread(target=serve, args=(door, program), daemon=True).start()
        declared = {"leaders": [0, 0], **information, **told}
        elsewhere = flown({"law": f"socket:{path}", "parameters": parameters, "information": declared}, file)
        door.shutdown(socket.SHUT_RDWR)
    here = flown({"law": law, "parameters": parameters}, file)
    assert np.ptp(here, axis=0).max() > 0.5
    assert np.abs(elsewhere - here).max() < 1e-9


def test_the_example_is_a_swarm():
    table = tomllib.loads((FOLDER / "consensus.toml").read_text())
    assert Swarm.model_validate(table).control.elsewhere
