"""Keys checked in a child: the package that reads certificates takes 12 MB, which nobody needs again in flight."""

from __future__ import annotations

import os
from datetime import datetime
from pathlib import Path

from flockwire_core.security.files import CredentialsError


def verify(folder: Path, identity: str, now: datetime, issuer: str, authorities: tuple[str, ...]) -> None:
    """Check the keys of `identity` as `load_credentials` does; raises CredentialsError, and OSError without a child.

    To be called before this process has a second thread.
    """

    def load() -> None:
        from flockwire_core.security.credentials import load_credentials  # noqa: PLC0415  (12 MB)

        load_credentials(folder, identity, now, issuer, authorities)

    child = os.fork()
    if child == 0:
        status = 1
        try:
            load()
            status = 0
        except CredentialsError:
            pass
        finally:
            os._exit(status)
    if os.waitpid(child, 0)[1] != 0:
        load()  # raises what the child found
