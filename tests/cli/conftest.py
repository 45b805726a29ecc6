"""The command line, called in this process, and a terminal."""

import os
import pty
from collections.abc import Iterator

import pytest
from command_line import CommandLine


@pytest.fixture
def flockwire(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> CommandLine:
    """Return the `flockwire` command."""
    return CommandLine(monkeypatch, capsys)


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[int, int]]:
    """Return both ends of a terminal, whose inner end is the standard input."""
    ours, theirs = pty.openpty()
    with os.fdopen(theirs) as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        yield ours, theirs
