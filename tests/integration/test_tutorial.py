"""The tutorial, typed as it is written: its files, then each command, in order, in an empty folder."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[2] / "docs/tutorial.md").read_text(encoding="utf-8")
STEP = re.compile(
    r"(?:(?P<verb>Save this as|add it to the end of) `(?P<file>[\w.]+)`(?P<between>(?:(?!```).)*?))?"
    r"```\w+\n(?P<text>.*?)```|^    (?P<command>\S[^\n]*)$",
    re.DOTALL | re.MULTILINE,
)
BEFORE = [
    "scripts/fly",
    "source .venv/bin/activate",
    "mkdir -p tutorial && cd tutorial",
]  # the environment of this test


def steps():
    """Yield (file, text, whether it is appended) and (command,) in the order of the page."""
    for found in STEP.finditer(PAGE):
        if found["command"]:
            yield (found["command"],)
        else:
            assert found["file"], f"nothing says where this belongs: {found['text'][:60]}"
            yield found["file"], found["text"], found["verb"].startswith("add")


def test_each_block_has_a_file_and_the_commands_come_after_the_environment():
    written = [one[0] for one in steps() if len(one) == 1]
    assert written[: len(BEFORE)] == BEFORE
    assert len(written) > 10
    assert {one[0] for one in steps() if len(one) == 3} == {
        "mine.toml",
        "wrong.toml",
        "show.py",
        "my_law.py",
        "laws.toml",
    }


@pytest.mark.long
def test_every_command_runs_in_order(tmp_path):
    environment, ran = dict(os.environ), []
    for step in list(steps())[len(BEFORE) :]:
        if len(step) == 3:
            file, text, appended = step
            with (tmp_path / file).open("a" if appended else "x", encoding="utf-8") as written:
                written.write("\n" + text)
            continue
        words = shlex.split(step[0], comments=True)
        if words[0] == "export":
            key, _, value = words[1].partition("=")
            environment[key] = value
            continue
        line = {"flockwire": [sys.executable, "-m", "flockwire_operator"], "python": [sys.executable]}[
            words[0]
        ] + words[1:]
        if words[1] == "study":
            line += ["--runs", "1", "--jobs", "1"]
        done = subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, (step, done.stdout, done.stderr)
        ran.append(words[1])
        if words[1] in ("sim", "show.py"):
            assert "all well" in done.stdout
    assert {"check", "sim", "animate", "compare", "show.py", "study"} == set(ran)
    assert (tmp_path / "first.gif").stat().st_size > 10_000
    assert (tmp_path / "runs/laws/study.html").exists()
