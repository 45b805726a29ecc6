"""README and docs/flights.md work as they are written, from a folder that has nothing but the swarm file."""

import contextlib
import re
import subprocess
import sys
from pathlib import Path

import psutil
import pytest
from fleet import PATIENCE
from ports import free_ports

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
FLIGHTS = (ROOT / "docs/flights.md").read_text(encoding="utf-8")


def section(title):
    """Return the commands of a section of docs/flights.md, without their comments."""
    text = FLIGHTS.partition(f"## {title}\n")[2].partition("\n## ")[0]
    return [line.split("#")[0].split() for line in re.findall(r"^    flockwire (.*)$", text, re.MULTILINE)]


@pytest.fixture
def folder(tmp_path):
    """Return a folder with the README's swarm, on ports of its own."""
    text = re.search(r"```toml\n(.*?)```", README, re.DOTALL)[1]
    (tmp_path / "mine.toml").write_text(f"{text}\n[network]\nbase_port = {free_ports()}\n")
    return tmp_path


@pytest.fixture
def started():
    """Return a list of processes, which end with the test."""
    processes: list[psutil.Popen] = []
    yield processes
    for process in processes:
        with contextlib.suppress(psutil.NoSuchProcess):
            process.kill()


def test_the_readme_is_short_and_its_first_commands_fly_and_test():
    section = README.partition("## Two commands\n")[2]
    commands = [line.split("#")[0].strip() for line in re.findall(r"^    (.*)$", section, re.MULTILINE)]
    assert commands[:2] == ["scripts/fly", "scripts/test"]
    assert README.count("\n") <= 80


@pytest.mark.parametrize("page", [README, FLIGHTS], ids=["README", "flights"])
def test_no_command_needs_what_no_command_before_it_made(page):
    commands = [line.split("#")[0] for line in re.findall(r"^    (.*)$", page, re.MULTILINE)]
    ready = commands.index("source .venv/bin/activate")
    assert not any(line.startswith("flockwire ") for line in commands[:ready])
    made: set[str] = set()
    for line in commands:
        made |= set(re.findall(r"--out (\S+)", line))
        for folder in re.findall(r"(runs/\w+)/trace.mcap", line):
            assert folder in made, line


@pytest.mark.long
def test_each_process_in_its_own_terminal(folder, started):
    def run(*arguments):
        line = [sys.executable, "-m", "flockwire_operator", *arguments]
        return subprocess.run(line, cwd=folder, capture_output=True, text=True, timeout=PATIENCE, check=False)

    def begin(*arguments):
        with (folder / "log").open("ab") as log:
            line = [sys.executable, "-m", "flockwire_operator", *arguments]
            started.append(psutil.Popen(line, cwd=folder, stdout=log, stderr=log))

    keys, *lines, report = section("Each process in its own terminal")
    assert keys == ["keys", "mine.toml"]
    assert run(*keys).returncode == 0
    orders = [line for line in lines if line[0] in ("start", "hold", "land", "stop")]
    others = [line for line in lines if line not in orders and line[0] not in ("status", "console", "formation")]
    for line in (*others, ["agent", "mine.toml", "2"], ["agent", "mine.toml", "3"]):
        begin(*line)
    assert orders[0][0] == "start"
    for order in orders:
        done = run(*order)
        assert done.returncode == 0, (order, done.stderr, (folder / "log").read_text()[-2000:])
        shown = run("status", "mine.toml")
        assert shown.returncode == 0, shown.stdout + shown.stderr
        assert (
            len([line for line in shown.stdout.splitlines() if line.startswith(("leader ", "uav1 ", "uav2 ", "uav3 "))])
            == 4
        )
    for process in started:
        process.terminate()
    psutil.wait_procs(started, timeout=PATIENCE)
    done = run(*report)
    assert "formation error" in done.stdout
    assert (folder / "runs" / "today" / "report.html").exists()
