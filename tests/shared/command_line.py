"""The `flockwire` command as a user calls it: in this process, which costs no new interpreter, or in one of its own."""

from __future__ import annotations

import subprocess
import sys
from typing import NamedTuple

import pytest
from flockwire_core.runtime.refusals import Refusals
from flockwire_operator.cli import entry


class Done(NamedTuple):
    """A command that has ended."""

    returncode: int
    stdout: str
    stderr: str


class CommandLine:
    """Calls the entry point in this process."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        self._monkeypatch, self._capsys = monkeypatch, capsys
        monkeypatch.setattr(Refusals, "watch", lambda _: None)  # it would take over the standard output for good

    def __call__(self, *arguments: object) -> Done:
        self._monkeypatch.setattr(sys, "argv", ["flockwire", *map(str, arguments)])
        self._capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            entry.main()
        code = ended.value.code
        assert isinstance(code, int)
        return Done(code, *self._capsys.readouterr())


def interpreter(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Call the command in an interpreter of its own."""
    line = [sys.executable, "-m", "flockwire_operator", *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, timeout=30, check=False)


def refused(done: Done | subprocess.CompletedProcess[str]) -> str:
    """Return the line that refuses a command."""
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    (line,) = done.stderr.strip().split("\n")
    return line
