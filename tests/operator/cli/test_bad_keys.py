"""Keys that cannot be used end a command at once: exit status 2 and one line."""

import errno
import logging
import os
import socket
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from command_line import interpreter, refused
from flockwire_core.loading import load_swarm
from flockwire_core.security.pki import make_keys
from flockwire_core.wire.plan import Plan

PAPER = Path(__file__).parents[3] / "examples" / "paper_simulation.toml"


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """Make the folder of each test the working directory."""
    monkeypatch.chdir(tmp_path)


def refused_process(flockwire, caplog, *arguments):
    """Return what a process of a swarm logs, without the time of day, before it ends with exit status 2."""
    with caplog.at_level(logging.INFO):
        assert flockwire(*arguments).returncode == 2
    (record,) = caplog.records
    return f"{record.name}: {record.getMessage()}"


@pytest.fixture
def folder(tmp_path):
    """Return the builder of the paper's keys, made some days ago."""

    def build(days=0):
        make_keys(Plan(load_swarm(PAPER)), tmp_path / "keys", datetime.now(UTC) - timedelta(days=days))
        return tmp_path / "keys"

    return build


@pytest.mark.parametrize("verb", ["land", "hold", "start"])
def test_a_keys_folder_that_is_missing(flockwire, verb):
    line = refused(flockwire(verb, PAPER, "--keys", "nowhere"))
    assert line == "flockwire: nowhere: there is no such keys folder; `flockwire keys SWARM` makes it"


def test_a_keys_folder_that_is_missing_in_an_interpreter_of_its_own():
    line = refused(interpreter("stop", PAPER, "--keys", "nowhere"))
    assert line == "flockwire: nowhere: there is no such keys folder; `flockwire keys SWARM` makes it"


@pytest.fixture
def denied(folder, monkeypatch):
    """Make keys that another user (sudo) owns: the folder may not be entered."""
    within, reason = folder(), os.strerror(errno.EACCES)

    def refusing(call, *answer):
        def ask(path, *more, **options):
            if within.name not in Path(path).parts[-3:-1]:
                return call(path, *more, **options)
            if answer:
                return answer[0]
            raise PermissionError(errno.EACCES, reason, str(path))

        return ask

    monkeypatch.setattr(Path, "stat", refusing(Path.stat))
    monkeypatch.setattr(Path, "read_bytes", refusing(Path.read_bytes))
    monkeypatch.setattr(os, "access", refusing(os.access, False))


@pytest.mark.parametrize("verb", ["stop", "land", "hold", "start", "conduct"])
def test_a_keys_folder_that_may_not_be_entered(flockwire, denied, verb):
    line = refused(flockwire(verb, PAPER, "--keys", "keys"))
    assert line.startswith("flockwire: keys/ca.crt: cannot read it: Permission denied; `chown -R` the keys folder")


def test_a_keys_folder_that_may_not_be_entered_is_none_to_fly_with(flockwire, denied):
    line = refused(flockwire("up", PAPER, "--keys", "keys", "--out", "out"))
    assert line == "flockwire: keys: cannot write keys there: Permission denied"


@pytest.mark.parametrize("verb", ["stop", "land", "hold", "start"])
def test_a_keys_folder_that_cannot_be_looked_at(flockwire, verb):
    line = refused(flockwire(verb, PAPER, "--keys", 300 * "x"))
    assert line.endswith("x: cannot read this keys folder: File name too long")


def test_an_order_without_the_operators_own_key(flockwire, folder):
    (folder() / "operator.key").unlink()
    line = refused(flockwire("stop", PAPER, "--keys", "keys"))
    assert line.startswith("flockwire: keys/operator.key: cannot read it: No such file or directory")


def test_a_keys_folder_from_the_environment_of_a_process_in_an_interpreter_of_its_own(monkeypatch):
    monkeypatch.setenv("FLOCKWIRE_KEYS", "elsewhere")
    line = refused(interpreter("leader", PAPER))
    assert line.endswith("leader: elsewhere: there is no such keys folder; `flockwire keys SWARM` makes it")


def test_a_private_key_that_others_may_read(flockwire, caplog, folder):
    (folder() / "uav1.key").chmod(0o644)
    line = refused_process(flockwire, caplog, "agent", PAPER, 1, "--keys", "keys")
    assert line == "uav1: keys/uav1.key: others may read this private key (mode 0644); chmod 600 it"


def test_an_expired_certificate(flockwire, caplog, folder):
    folder(days=91)
    line = refused_process(flockwire, caplog, "gateway", PAPER, "--keys", "keys")
    assert line.startswith("gateway: keys/gateway.crt: expired on ")


def test_a_folder_that_holds_something_else(tmp_path, flockwire):
    (tmp_path / "keys" / "authority").mkdir(parents=True)
    for name in ("ca.crt", "authority/ca.key"):
        (tmp_path / "keys" / name).write_text("junk")
    line = refused(flockwire("up", PAPER, "--keys", "keys"))
    assert line.startswith("flockwire: keys: its authority cannot be read: ")
    assert line.endswith("; --rotate makes a new one")


def test_a_file_in_place_of_the_folder(tmp_path, flockwire):
    (tmp_path / "keys").touch()
    line = refused(flockwire("keys", PAPER, "--out", "keys"))
    assert line.startswith("flockwire: keys: cannot write keys there: ")


def test_a_check_of_keys_that_cannot_be_read_gives_no_traceback(tmp_path, flockwire):
    (tmp_path / "uav1.crt").write_text("junk")
    done = flockwire("check", PAPER, "--keys", tmp_path)
    assert "Traceback" not in done.stderr
    assert str(tmp_path / "uav1.crt") in done.stdout + done.stderr


def test_a_check_warns_two_weeks_before_the_end(flockwire, folder):
    folder(days=80)
    done = flockwire("check", PAPER, "--keys", "keys")
    assert done.returncode == 0
    assert "warning: keys/uav1.crt: ends on " in done.stdout


def test_without_security_a_warning_is_said_and_no_key_is_made(tmp_path, flockwire):
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        port = listener.getsockname()[1]
        table = f'[network]\nsecurity = "none"\nbase_port = {port}\n\n[control]'
        (tmp_path / "open.toml").write_text(PAPER.read_text().replace("[control]", table, 1))
        done = flockwire("up", "open.toml", "--headless", "--out", "out")
    assert done.returncode == 2
    warning, busy = done.stderr.strip().split("\n")
    assert warning.startswith(
        "flockwire: warning: network.security = 'none': any process that reaches a port can read and write all"
    )
    assert "is in use" in busy
    assert not (tmp_path / ".flockwire").exists()
