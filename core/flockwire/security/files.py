"""Where the certificates of a process are."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


class CredentialsError(ValueError):
    """Keys that cannot be used; the text is one line: the file, what is wrong, what to do."""


def default_folder(name: str, beside: Path = Path()) -> Path:
    """Return where the keys of the swarm called `name` are unless the user says otherwise: `beside` its file."""
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
    """Return the files of `identity` in `folder`, whether they are there or not."""
    return Credentials(folder / "ca.crt", folder / f"{identity}.crt", folder / f"{identity}.key")
