"""The command line, called in this process."""

import pytest
from command_line import CommandLine


@pytest.fixture
def flockwire(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> CommandLine:
    """Return the `flockwire` command."""
    return CommandLine(monkeypatch, capsys)
