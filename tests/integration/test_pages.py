"""Every command of every page, typed as it is written, in a folder that has the files which the page presupposes.

The commands are those beside this Python; FLOCKWIRE_BIN names the folder of another environment, as one that pip made.
What a page begins in other terminals runs until the page's end; studies are shorter. What no machine of tests has, and
what takes minutes and has a test of its own, is left out by name.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from fleet import PATIENCE
from flockwire_core import clock
from flockwire_core.domain.time import SECOND
from ports import free_port, free_ports

pytestmark = [pytest.mark.long, pytest.mark.campaign]
ROOT = Path(__file__).parents[2]
BIN = os.environ.get("FLOCKWIRE_BIN") or str(Path(sys.executable).parent)
STEP = re.compile(
    r"(?:(?P<verb>Save this as|add it to the end of) `(?P<file>[\w.]+)`(?P<between>(?:(?!```).)*?))?"
    r"```\w+\n(?P<text>.*?)```|^    (?P<command>(?:export|flockwire|g\+\+|pytest|python) [^\n]*|pytest)$",
    re.DOTALL | re.MULTILINE,
)  # fmt: skip
LEFT_OUT = {  # by how a command begins
    "octave": "Octave is a test's own matter",
    "export RMW": "ROS 2 is needed",
    "flockwire align mine.toml --at": "a room with such bodies is needed",
    "flockwire animate runs/real/trace.mcap --out flight.mp4": "ffmpeg is needed",
    "flockwire convert": "others' trajectories are needed",
    "flockwire probe": "minutes",
    "flockwire sim worst/": "found by a study of a thousand",
    "flockwire study SWARM STUDY.toml": "a synopsis",
    "flockwire study found/": "found by a search",
    "flockwire teleop": "a keyboard is needed",
}
UNTIL_THE_END = (  # another terminal's, by how it begins after `flockwire`
    "agent", "console", "gateway", "kinematics", "leader", "recorder", "tello-sim --address", "tracker-sim",
    "up swarm.toml --host second", "up swarm.toml --duration 0",
)  # fmt: skip
SHORTER = {"study": " --runs 1 --jobs 1", "compare-laws": " --runs 1"}
VERDICTS = ("study", "compare-laws", "report", "up")  # 1 after a flight that failed, which is no mistake of a page
MEANT = {"SWARM": "mine.toml", "mine.toml NAME": "mine.toml wide"}
WIDE = '\n[formations.wide]\nkind = "circle"\nradius = 2.0\nrate = 0.3\n'
NATNET = '\n[gateway]\nsource = "natnet"\n[gateway.natnet]\nserver = "127.0.0.1"\ncommand_port = {udp}\n'
FLYING = ("flockwire up mine.toml --duration 0 --headless", "in formation")  # and what shows that it began


def block(page: str, language: str, word: str = "") -> str:
    """Return the first block of a page in a language that has a word."""
    text = (ROOT / page).read_text(encoding="utf-8")
    return next(one for one in re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL) if word in one)


@dataclass(frozen=True)
class Page:
    """What a page presupposes: more tables of mine.toml, other files, commands, and processes with what they print."""

    tables: str = WIDE
    files: dict[str, str] = field(default_factory=dict)
    made: tuple[str, ...] = ()
    running: tuple[tuple[str, str], ...] = ()


LAW = {"my_law.py": block("docs/own_law.md", "python")}
WRONG = {"wrong.toml": block("docs/faults.md", "toml")}
PAGES = {
    "README.md": Page(),
    "docs/console.md": Page(running=(FLYING,)),
    "docs/faults.md": Page(files=WRONG),
    "docs/flights.md": Page(
        files=WRONG,
        made=tuple(f"flockwire sim mine.toml --duration 8 --out runs/{law}/1" for law in ("paper", "extended")),
    ),
    "docs/formations.md": Page(block("docs/formations.md", "toml", "[formations.rose]"), running=(FLYING,)),
    "docs/gallery.md": Page(),
    "docs/law_elsewhere.md": Page(),
    "docs/leaders.md": Page(),
    "docs/own_law.md": Page(files={"gains.toml": block("docs/own_law.md", "toml", "[grid]")}),
    "docs/ros.md": Page("\n[ros]\nserve = true\n"),
    "docs/scripting.md": Page(files={"show.py": block("docs/scripting.md", "python", "open_swarm")}),
    "docs/study.md": Page(files=LAW | {"STUDY.toml": block("docs/study.md", "toml")}),
    "docs/tello_clients.md": Page(),
    "docs/tracking.md": Page(NATNET, running=(("flockwire tracker-sim mine.toml --protocol natnet", "serves"),)),
    "docs/tutorial.md": Page(),
    "docs/concepts/access_control.md": Page(),
}  # fmt: skip
EXAMPLES = (ROOT / "examples/README.md").read_text(encoding="utf-8")


def steps(text: str) -> Iterator[tuple[str, ...]]:
    """Yield (file, text, whether it is appended) and (command,) in the order of a page."""
    for found in STEP.finditer(text):
        if found["command"]:
            yield (found["command"].partition(" #")[0].rstrip(),)
        elif found["file"]:
            yield found["file"], found["text"], found["verb"][:3]


def ported(text: str) -> str:
    """Return a swarm file on ports of its own."""
    network = "" if "[network]" in text else f"\n[network]\nbase_port = {free_ports()}\n"
    text = text.replace("{udp}", str(free_port(socket.SOCK_DGRAM)))
    return text + network + "[checks]\ncontrol_rate = 0.5\n"  # others fly beside it


class Terminals:
    """Types lines into shells in `folder`, whose programs are those of BIN; at the end it ends what still runs."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.running = folder, list[tuple[str, subprocess.Popen[bytes], Path]]()
        self.environment = os.environ | {"PATH": f"{BIN}:{os.environ['PATH']}"}
        self.environment.pop("PYTHONPATH", None)

    def type(self, line: str) -> None:
        """Run a command of a page as it means it."""
        if line.startswith(tuple(LEFT_OUT)):
            return
        for written, meant in MEANT.items():
            line = line.replace(written, meant)
        program, _, rest = line.partition(" ")
        if program == "export":
            name, _, value = rest.partition("=")
            self.environment[name] = value
        elif program == "g++":
            compiled, _, law = line.partition(" && ")
            assert self.shell(compiled).returncode == 0
            self.begin(law, "listens")
        elif program == "flockwire" and rest.startswith(UNTIL_THE_END):
            for one in [line] if rest != "agent mine.toml 1" else [f"{line[:-1]}{i}" for i in (1, 2, 3)]:
                self.begin(one)
        else:
            verb = rest.split()[0] if program == "flockwire" else program
            done = self.shell(line + SHORTER.get(verb, ""))
            while "takes another" in done.stdout:  # the change before it; a reader types more slowly
                done = self.shell(line)
            print(f"$ {line}\n{done.stdout[-2000:]}")
            assert done.returncode in ((0, 1) if verb in VERDICTS else (0,)), line
            assert "Traceback" not in done.stdout, line
            if verb == "sim" or program == "python":
                assert "FAIL" not in done.stdout, line

    def shell(self, line: str) -> subprocess.CompletedProcess[str]:
        """Run a line to its end."""
        return subprocess.run(
            ["bash", "-c", line], cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=10 * PATIENCE, check=False,
        )  # fmt: skip

    def begin(self, line: str, until: str = "") -> None:
        """Begin what runs until the end, but for what runs already; waits until it has printed a line, with `until`."""
        if line in [one for one, *_ in self.running]:
            return
        for one in [one for one in self.running if one[0].split()[1:3] == line.split()[1:3] != ["agent", "mine.toml"]]:
            self.end(*one)  # this one is typed into its terminal
        log = self.folder / f"{len([*self.folder.glob('*.log')])}.log"
        with log.open("wb") as out:
            started = subprocess.Popen(
                ["bash", "-c", line], cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL, stdout=out,
                stderr=out, start_new_session=True,
            )  # fmt: skip
        self.running.append((line, started, log))
        patience = clock.now() + PATIENCE * SECOND
        while not log.read_text() or until not in log.read_text():
            assert started.poll() is None, log.read_text()
            assert clock.now() < patience, log.read_text()
            time.sleep(0.2)

    def end(self, line: str, started: subprocess.Popen[bytes], log: Path) -> None:
        """Press Ctrl-C in a terminal: its program ends by itself, without an error."""
        self.running.remove((line, started, log))
        with contextlib.suppress(ProcessLookupError):
            os.killpg(started.pid, signal.SIGINT)
        try:
            status = started.wait(3 * PATIENCE)  # it may land, judge and draw a report
        finally:
            if started.poll() is None:
                os.killpg(started.pid, signal.SIGKILL)
        print(f"$ {line}\n{log.read_text()[-2000:]}")
        assert "Traceback" not in log.read_text(), line
        assert status in ((0, 1) if line.startswith("flockwire up") else (0,)) or line.startswith("./"), (line, status)


@pytest.fixture
def terminals(tmp_path: Path) -> Iterator[Terminals]:
    """Return the terminals of a reader."""
    opened = Terminals(tmp_path)
    yield opened
    with contextlib.ExitStack() as stack:
        for one in opened.running:  # the newest first, and all
            stack.callback(opened.end, *one)


@pytest.mark.parametrize("name", PAGES)
def test_a_page(name: str, terminals: Terminals) -> None:
    folder, page = terminals.folder, PAGES[name]
    for shown in ("examples", "laws"):
        shutil.copytree(ROOT / shown, folder / shown, ignore=shutil.ignore_patterns("*.py", "runs"))
    flown = folder / "examples/paper_simulation.toml"
    flown.write_text(ported(flown.read_text()))
    if name != "docs/tutorial.md":
        (folder / "mine.toml").write_text(ported(block("README.md", "toml", "graph") + page.tables))
    for file, content in page.files.items():
        (folder / file).write_text(content)
    for line in page.made:
        terminals.shell(line)
    for line, until in page.running:
        terminals.begin(line, until)
    typed = 0
    for step in steps((ROOT / name).read_text(encoding="utf-8")):
        if len(step) == 1:
            terminals.type(step[0])
            typed += 1
        else:
            with (folder / step[0]).open("a" if step[2] == "add" else "x", encoding="utf-8") as file:
                file.write("\n" + step[1])
    assert typed


@pytest.mark.parametrize("name", re.findall(r"^## (\w+)$", EXAMPLES, re.MULTILINE))
@pytest.mark.parametrize("real", [False, True], ids=["virtual", "real"])
def test_an_example(name: str, real: bool, terminals: Terminals) -> None:
    section = EXAMPLES.partition(f"## {name}\n")[2].partition("\n## ")[0]
    shutil.copytree(ROOT / "examples" / name, terminals.folder, dirs_exist_ok=True)
    file = terminals.folder / "swarm.toml"
    text = file.read_text()
    if tomllib.loads(text)["gateway"].get("source") == "natnet":
        text += "\n[gateway.natnet]\ncommand_port = {udp}\n"
    file.write_text(ported(text))
    lines = [step[0] for step in steps(section)]
    if real:  # "`flockwire up swarm.toml` flies the same with real processes"
        lines = [f"{line} --real" if line.startswith("python") else line for line in lines if " study " not in line]
        lines = [re.sub(r" sim (.*?)( --duration \d+)?( --out \S+)$", r" up \1 --duration 15", line) for line in lines]
    assert lines or name == "fault_campaign"  # which is a study
    for line in lines:
        terminals.type(line)
