"""The files of a process's certificates."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


class CredentialsError(ValueError):
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
    return Credentials(folder / "ca.crt", folder / f"{identity}.crt", folder / f"{identity}.key")
