"""Checks the credentials of a process before they are used, because a peer rejects bad ones silently."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from datetime import datetime, timedelta
from functools import partial
from pathlib import Path
from typing import TypeVar

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import serialization
from cryptography.x509.oid import NameOID

from flockwire_core.security.files import Credentials, CredentialsError, files_of
from flockwire_core.wire.plan import AUTHORITY

MAKE = "`flockwire keys SWARM` makes it"
NO_FOLDER = f"there is no such keys folder; {MAKE}"
CHOWN = "`chown -R` the keys folder to the user who runs this"
SYSTEMD = "CREDENTIALS_DIRECTORY"  # names the folder of a service's own keys
Loaded = TypeVar("Loaded")
FORMAT = "%Y-%m-%d %H:%M UTC"


def load_credentials(
    folder: Path,
    identity: str,
    now: datetime,
    issuer: str = AUTHORITY,
    authorities: tuple[str, ...] = (AUTHORITY,),
    lasting: timedelta = timedelta(),
) -> Credentials:
    """Check the keys of `identity` in `folder` as of `now`; raises CredentialsError.

    Its certificate must be of the authority `issuer`; it needs the certificates of all `authorities`, and all must be
    valid for the time `lasting`.
    """
    files = files_of(folder, identity)
    _check_folder(folder)
    trusted = {name: _certificate(files.signed_by(name)) for name in authorities}
    certificate = _certificate(files.certificate)
    load_key = partial(serialization.load_pem_private_key, password=None)
    key = _loaded(files.key, load_key, "a private key in PEM form, without a password")
    _check_private(files.key)
    if certificate.public_key() != key.public_key():
        raise CredentialsError(f"{files.certificate}: does not belong to the key {files.key.name} beside it")
    name = common_name(certificate)
    if name != identity:
        raise CredentialsError(f"{files.certificate}: is for {name!r}, this process is {identity!r}")
    try:
        certificate.verify_directly_issued_by(trusted[issuer])
    except (ValueError, TypeError, InvalidSignature):
        signer = files.signed_by(issuer)
        raise CredentialsError(f"{files.certificate}: was not signed by the authority {signer}") from None
    _check_dates(files.certificate, certificate, now, lasting)
    for name, held in trusted.items():
        _check_dates(files.signed_by(name), held, now, lasting)
    return files


def common_name(certificate: x509.Certificate) -> str:
    """Return the name of a certificate, empty if it has none."""
    names = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(names[0].value) if names else ""


def _check_folder(folder: Path) -> None:
    """Refuse a path that is not a folder, and a folder in which others may replace keys."""
    try:
        mode = folder.stat().st_mode
    except FileNotFoundError:
        raise CredentialsError(f"{folder}: {NO_FOLDER}") from None
    except OSError as error:
        remedy = f"; {CHOWN}" if isinstance(error, PermissionError) else ""
        raise CredentialsError(f"{folder}: cannot read this keys folder: {error.strerror}{remedy}") from None
    if not stat.S_ISDIR(mode):
        raise CredentialsError(f"{folder}: {NO_FOLDER}")
    if mode & 0o022:
        raise CredentialsError(
            f"{folder}: others may write into this keys folder (mode {mode & 0o777:04o}); chmod 700 it"
        )


def _check_private(key: Path) -> None:
    """Refuse a private key that others may read."""
    mode = stat.S_IMODE(key.stat().st_mode)
    # systemd's own folder lets one service in by an access-control list, which shows as the group's bits.
    if mode & (0o007 if str(key.parent) == os.environ.get(SYSTEMD) else 0o077):
        raise CredentialsError(f"{key}: others may read this private key (mode {mode:04o}); chmod 600 it")


def _check_dates(path: Path, certificate: x509.Certificate, now: datetime, lasting: timedelta) -> None:
    begin, end = certificate.not_valid_before_utc, certificate.not_valid_after_utc
    if now > end:
        raise CredentialsError(f"{path}: expired on {end:{FORMAT}}; `flockwire keys SWARM` renews it")
    if now + lasting > end:
        hours = lasting // timedelta(hours=1)
        raise CredentialsError(
            f"{path}: expires on {end:{FORMAT}}, and a flight needs {hours} h; `flockwire keys SWARM` renews it"
        )
    if now < begin:
        raise CredentialsError(
            f"{path}: is valid from {begin:{FORMAT}} on, and this machine's clock says {now:{FORMAT}}; set the clock, "
            f"or if it is right, {MAKE} again"
        )


def _loaded(path: Path, load: Callable[[bytes], Loaded], form: str) -> Loaded:
    try:
        return load(path.read_bytes())
    except OSError as error:
        remedy = CHOWN if isinstance(error, PermissionError) else MAKE
        raise CredentialsError(f"{path}: cannot read it: {error.strerror}; {remedy}") from None
    except (ValueError, TypeError):
        raise CredentialsError(f"{path}: is not {form}") from None


def _certificate(path: Path) -> x509.Certificate:
    return _loaded(path, x509.load_pem_x509_certificate, "a certificate in PEM form")
