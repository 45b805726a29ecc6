"""Keys are checked in a child, with the same result."""

import os
import signal

import pytest
from flockwire_core.security import credentials
from flockwire_core.security.credentials import load_credentials
from flockwire_core.security.files import CredentialsError
from flockwire_core.security.verification import verify
from flockwire_core.wire.plan import AUTHORITY


@pytest.fixture
def checked_here(monkeypatch):
    """Count the checks of this very process; a child's are not seen."""
    calls = []

    def counted(*arguments):
        calls.append(arguments)
        return load_credentials(*arguments)

    monkeypatch.setattr(credentials, "load_credentials", counted)
    return calls


def test_good_keys_are_checked_in_a_child_alone(keys, made, checked_here):
    verify(keys, "uav1", made, AUTHORITY, (AUTHORITY,))
    assert not checked_here


def test_bad_keys_are_refused_in_the_same_words(keys, made, checked_here):
    (keys / "uav1.key").chmod(0o644)
    with pytest.raises(CredentialsError, match="others may read this private key"):
        verify(keys, "uav1", made, AUTHORITY, (AUTHORITY,))
    assert len(checked_here) == 1


def test_a_child_that_dies_decides_nothing(keys, made, checked_here, monkeypatch):
    parent, counted = os.getpid(), credentials.load_credentials

    def dies(*arguments):
        if os.getpid() != parent:
            os.kill(os.getpid(), signal.SIGKILL)
        return counted(*arguments)

    monkeypatch.setattr(credentials, "load_credentials", dies)
    verify(keys, "uav1", made, AUTHORITY, (AUTHORITY,))
    assert len(checked_here) == 1
