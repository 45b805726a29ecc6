"""A clone's .venv has the code as it was installed; who edited a source since is told."""

import os

import pytest
from flockwire_operator.cli.entry import CHANGED, changed_source


@pytest.fixture
def root(tmp_path):
    """Return a clone, installed at time 100, with a source of time 90."""
    source = tmp_path / "core/flockwire_core/law.py"
    for file, time in ((source, 90), (tmp_path / ".venv/flockwire-made", 100)):
        file.parent.mkdir(parents=True)
        file.touch()
        os.utime(file, (time, time))
    return tmp_path


def test_a_source_that_is_newer_than_the_users_environment_is_named(root):
    prefix, source = root / ".venv", root / "core/flockwire_core/law.py"
    assert changed_source(prefix) == ""
    os.utime(source, (110, 110))
    assert changed_source(prefix) == CHANGED.format(file=source, prefix=prefix, script=root / "scripts/fly")


def test_another_environment_says_nothing(root):
    os.utime(root / "core/flockwire_core/law.py", (110, 110))
    assert changed_source(root / ".venv-dev") == changed_source(root / "nowhere/.venv") == ""
