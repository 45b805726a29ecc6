"""The folders of a flight: certificates, made if missing, and trace."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from flockwire_core import clock
from flockwire_core.security.files import CredentialsError, default_folder
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import OPERATOR


def check_no_trace(out: Path) -> None:
    """Raise FileExistsError for a folder that already has a trace."""
    if os.access(out / "trace.mcap", os.F_OK):
        raise FileExistsError(f"{out}: there is a trace of another flight; name a new folder")


def warn_of(swarm: Swarm) -> None:
    """Warn if the swarm has no security."""
    if swarm.network.security == "none":
        print(
            "flockwire: warning: network.security = 'none': any process that reaches a port can read and write all",
            file=sys.stderr,
        )


def target(file: Path) -> Path:
    """Return the file that `file` names: a symbolic link and its target have one folder of keys and one flight."""
    return file.resolve() if file.is_symlink() else file


def keys_folder(file: Path, plan: Plan, keys: Path | None) -> Path:
    """Return the folder of the certificates: `keys`, or that of the swarm beside its `file`."""
    return keys or default_folder(plan.swarm.name, target(file).parent)


def complete_keys(file: Path, plan: Plan, keys: Path | None, host: str) -> Path:
    """Return the folder of the certificates, after making missing ones if the authority's key is or may be here.

    A warning names those made in `keys`, which may be mistyped. Raises CredentialsError.
    """
    from flockwire_core.security.credentials import load_credentials  # noqa: PLC0415
    from flockwire_core.security.pki import FLIGHT, expiring  # noqa: PLC0415

    folder = keys_folder(file, plan, keys)
    warn_of(plan.swarm)
    if plan.swarm.network.security != "mtls":
        return folder
    first = next(iter(plan.swarm.hosts)) == host  # keys of another host come from the first one
    if os.access(folder / "authority/ca.key", os.F_OK) or (first and not os.access(folder / "ca.crt", os.F_OK)):
        made = renew_keys(plan, folder)
        if made and keys is not None:
            which = "a new authority and all keys" if set(plan.authorities) <= set(made) else ", ".join(made)
            print(f"flockwire: warning: --keys = {folder}: made {which} there")
    for identity in (*plan.processes_on(host), OPERATOR.kind):
        load_credentials(folder, identity, clock.utc(), plan.issuer(identity), plan.authorities, FLIGHT)
    for line in expiring(plan, folder, clock.utc()):
        print(f"flockwire: warning: {line}", file=sys.stderr)
    return folder


def renew_keys(plan: Plan, folder: Path, rotate: bool = False) -> tuple[str, ...]:
    """Make the certificates in `folder` as `make_keys` does; raises CredentialsError if it fails."""
    from flockwire_core.security.pki import make_keys  # noqa: PLC0415

    try:
        return make_keys(plan, folder, clock.utc(), rotate)
    except OSError as error:
        raise CredentialsError(f"{folder}: cannot write keys there: {error.strerror or error}") from None
    except ValueError as error:  # also a file that is no certificate
        raise CredentialsError(str(error)) from None
