"""Where the certificates of a process are, and whether they are in use: every session holds those of its folder.

Nobody may replace the authority of keys in use. It is a shared lock on its certificate, which the system releases when
the process ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from flockwire_core.locking import SHARED, is_held, lock, opened
from flockwire_core.swarm.wording import InputError

AUTHORITY_FILE = "ca.crt"  # the certificate that all others are signed by


class CredentialsError(InputError):
    """Unusable keys; the text is one line: file, problem, remedy."""


def default_folder(name: str, beside: Path = Path()) -> Path:
    """Return the default folder of the keys of the swarm called `name`: `beside` its file."""
    return beside / ".flockwire" / name / "keys"


@dataclass(frozen=True, slots=True)
class Credentials:
    """The files of one identity."""

    authority: Path
    certificate: Path
    key: Path

    def signed_by(self, authority: str) -> Path:
        """Return the certificate of the authority of that name."""
        return self.authority.with_name(f"{authority}.crt")


def files_of(folder: Path, identity: str) -> Credentials:
    """Return the files of `identity` in `folder`, whether they exist or not."""
    return Credentials(folder / AUTHORITY_FILE, folder / f"{identity}.crt", folder / f"{identity}.key")


def hold(folder: Path) -> BinaryIO | None:
    """Lock the keys in `folder` until the returned file is closed.

    Returns None if the file system has no locks: no order waits for one.
    """
    try:
        held = (folder / AUTHORITY_FILE).open("rb")
    except OSError:
        return None
    if lock(held, SHARED):
        return held
    held.close()
    return None


def in_use(folder: Path) -> bool:
    """Return whether a process of this machine, also in a container, has locked the keys in `folder`."""
    try:
        with opened(folder / AUTHORITY_FILE) as held:
            return bool(is_held(held))
    except OSError:
        return False
