"""Locks on file systems with the rules of NFS, and without locks."""

import errno
import fcntl
import os

import pytest
from flockwire_core.locking import EXCLUSIVE, NOW, SHARED, is_held, lock, opened
from flockwire_core.security.files import hold, in_use
from flockwire_core.security.pki import make_keys

FLOCK = fcntl.flock


def nfs(file, how):
    """Lock as an NFS client does: an exclusive lock needs a file that is open for writing."""
    number = file if isinstance(file, int) else file.fileno()
    if how & fcntl.LOCK_EX and fcntl.fcntl(number, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY:
        raise OSError(errno.EBADF, os.strerror(errno.EBADF))
    return FLOCK(file, how)


def nothing(file, how):
    raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))


@pytest.fixture
def path(tmp_path):
    (tmp_path / "held").touch()
    return tmp_path / "held"


def test_a_shared_lock_of_another_is_seen(path):
    with opened(path) as mine:
        assert is_held(mine) is False
        lock(mine, SHARED)
        with opened(path) as other:
            assert is_held(other) is True
        with opened(path) as other, pytest.raises(BlockingIOError):
            lock(other, EXCLUSIVE | NOW)


def test_the_look_of_another_command_is_no_holder(path):
    """Two commands at once after a power cut: the first's look is not taken for a flight by the second."""
    with opened(path) as first, opened(path) as second:
        assert is_held(first) is False  # it is locked exclusively until it is closed
        assert is_held(second) is False


def test_a_file_that_may_only_be_read_is_locked_all_the_same(path, monkeypatch):
    def refuse(*_):
        raise PermissionError

    monkeypatch.setattr(os, "open", refuse)
    with opened(path) as file:
        assert lock(file, SHARED)


def test_keys_on_nfs(make_plan, tmp_path, monkeypatch, made):
    monkeypatch.setattr(fcntl, "flock", nfs)
    assert make_keys(make_plan(), tmp_path / "keys", made)
    assert not in_use(tmp_path / "keys")
    held = hold(tmp_path / "keys")
    assert in_use(tmp_path / "keys")
    held.close()
    assert not in_use(tmp_path / "keys")


def test_keys_without_any_locks(make_plan, tmp_path, monkeypatch, made):
    monkeypatch.setattr(fcntl, "flock", nothing)
    assert make_keys(make_plan(), tmp_path / "keys", made)
    assert hold(tmp_path / "keys") is None
    assert not in_use(tmp_path / "keys")
