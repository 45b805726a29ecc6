"""The swarm's certificates: one EC P-256 certificate per identity, with its name, and the authorities.

    FOLDER/authority/ca.key            signs those of processes; never copied to drones
    FOLDER/authority/operators.key     signs those of operators; the same
    FOLDER/ca.crt                      what every process trusts
    FOLDER/operators.crt               what it trusts at the endpoint that is reserved for operators
    FOLDER/IDENTITY.crt, IDENTITY.key  what a process shows, to those that it dials and those that dial it

Making keys is idempotent: good certificates stay; those that expire soon or have another host's address are made again.
"""

from __future__ import annotations

import ipaddress
import os
import secrets
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from flockwire_core.locking import EXCLUSIVE, lock, opened
from flockwire_core.security.credentials import FORMAT
from flockwire_core.security.files import CredentialsError, in_use
from flockwire_core.wire.plan import AUTHORITY, Plan

LOCK = ".lock"
LIFE = timedelta(days=90)
AUTHORITY_LIFE = timedelta(days=3650)
RENEW = timedelta(days=30)  # before its end a certificate is renewed
WARN = timedelta(days=14)  # before its end `check` warns
FLIGHT = timedelta(hours=12)  # a flight starts only with certificates that last so long
BEGIN = datetime(1970, 1, 1, tzinfo=UTC)  # of all certificates: a clock that is set back in flight ends no link


@dataclass(frozen=True, slots=True)
class Signer:
    """A certificate with its private key."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey


def make_keys(plan: Plan, folder: Path, now: datetime, rotate: bool = False) -> tuple[str, ...]:
    """Make missing, wrong and soon expiring certificates; returns their names.

    With `rotate`, make a new authority and all certificates: earlier ones are rejected afterwards. No authority is
    replaced while a process uses the folder's keys. Raises CredentialsError, OSError if the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    folder.chmod(0o700)
    (folder / LOCK).touch(0o600)
    with opened(folder / LOCK) as makers:
        lock(makers, EXCLUSIVE)  # concurrent calls wait for each other
        return _make_keys(plan, folder, now, rotate)


def _make_keys(plan: Plan, folder: Path, now: datetime, rotate: bool) -> tuple[str, ...]:
    held = {} if rotate else _held(plan, folder)
    if not rotate and AUTHORITY not in held and (folder / "ca.crt").exists():
        return _without_authority(plan, folder, now)
    signers = {name: signer for name, signer in held.items() if _lasts(signer.certificate, now)}
    made = [name for name in plan.authorities if name not in signers]
    if made and in_use(folder):
        raise CredentialsError(
            f"{folder}: processes of this machine run with these keys, and no order, not even a stop, would reach "
            "them from those of a new authority; end them first"
        )
    for name in made:
        signers[name] = new = new_authority(plan.swarm.name, now)
        save(new, folder, name, folder / "authority")
    return (*made, *_renew(plan, folder, signers, now))


def _renew(plan: Plan, folder: Path, signers: dict[str, Signer], now: datetime) -> Iterator[str]:
    """Make the certificates of processes that are not good; yield their names."""
    for identity in plan.identities:
        if not _good(plan, folder, identity, now):
            signer = signers[plan.issuer(identity)]
            save(issue(signer, identity, alternative_names(plan, identity), BEGIN, now + LIFE), folder, identity)
            yield identity


def _held(plan: Plan, folder: Path) -> dict[str, Signer]:
    """Return the authorities whose keys are here."""
    found = {}
    for name in plan.authorities:
        with suppress(FileNotFoundError):
            found[name] = read_authority(folder, name)
    return found


def _without_authority(plan: Plan, folder: Path, now: datetime) -> tuple[str, ...]:
    """Make nothing, because the authority's key is elsewhere; raises CredentialsError if a certificate is needed."""
    for name in (*plan.authorities, *plan.identities):
        held = (folder / f"{name}.crt").exists()
        # a process without a certificate is another host's
        stays = held if name in plan.authorities else not held or _good(plan, folder, name, now)
        if not stays:
            raise CredentialsError(
                f"{folder / name}.crt: has to be made again, and the authority's key is not here; run "
                "`flockwire keys` where authority/ca.key is and copy the files, or use --rotate for a new authority"
            )
    return ()


def alternative_names(plan: Plan, identity: str) -> tuple[str, ...]:
    """Return the addresses and names of `identity`: its host's, its own as a service, loopback."""
    host = plan.hosts[identity]
    listening = plan.endpoints.get(identity, "").rpartition(":")[0].strip("[]")
    names = (listening, plan.swarm.hosts[host].address, "127.0.0.1", "::1", host, identity, "localhost")
    return tuple(dict.fromkeys(name for name in names if name))


def issue(authority: Signer, name: str, alternatives: tuple[str, ...], begin: datetime, end: datetime) -> Signer:
    """Return a new certificate for `name`, valid from `begin` to `end`, with its key."""
    key = ec.generate_private_key(ec.SECP256R1())
    certificate = (
        _builder(name, authority.certificate.subject, key, begin, end)
        .add_extension(x509.SubjectAlternativeName(list(_general_names(alternatives))), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(
            x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]), critical=False
        )
        .sign(authority.key, hashes.SHA256())
    )
    return Signer(certificate, key)


def expiring(plan: Plan, folder: Path, now: datetime) -> Iterator[str]:
    """Yield a line for each certificate that is not valid yet, or expires within two weeks of `now`, or has expired."""
    for identity in (*plan.authorities, *plan.identities):
        path = folder / f"{identity}.crt"
        try:
            certificate = x509.load_pem_x509_certificate(path.read_bytes())
        except FileNotFoundError:
            continue
        except OSError as error:
            yield f"{path}: cannot read it: {error.strerror}"
        except ValueError:
            yield f"{path}: is not a certificate; `flockwire keys` makes it again"
        else:
            begin, end = certificate.not_valid_before_utc, certificate.not_valid_after_utc
            if begin > now:
                yield f"{path}: is valid from {begin:{FORMAT}} on; `flockwire keys` makes it again"
            elif end - now < WARN:
                yield f"{path}: ends on {end:%Y-%m-%d}; `flockwire keys` renews it"


def save(signer: Signer, folder: Path, name: str, secret: Path | None = None) -> None:
    """Write a certificate and its key as `name`.crt and `name`.key, the key into the folder `secret` if given."""
    pem = serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    _write((secret or folder) / f"{name}.key", signer.key.private_bytes(*pem), private=True)
    _write(folder / f"{name}.crt", signer.certificate.public_bytes(serialization.Encoding.PEM))


def read_authority(folder: Path, name: str = AUTHORITY) -> Signer:
    """Read the authority `name` with its key; raises FileNotFoundError if the key is kept elsewhere."""
    path = folder / "authority" / f"{name}.key"
    try:
        key = serialization.load_pem_private_key(path.read_bytes(), None)
        certificate = x509.load_pem_x509_certificate((folder / f"{name}.crt").read_bytes())
    except FileNotFoundError:
        raise FileNotFoundError(f"{path}: the authority's key is not here") from None
    except (ValueError, TypeError) as error:
        raise CredentialsError(f"{folder}: its authority cannot be read: {error}; --rotate makes a new one") from None
    if not isinstance(key, ec.EllipticCurvePrivateKey) or certificate.public_key() != key.public_key():
        raise CredentialsError(f"{path}: is not the key of {name}.crt; --rotate makes a new authority")
    return Signer(certificate, key)


def new_authority(name: str, now: datetime) -> Signer:
    """Return a new authority for the swarm called `name`."""
    key = ec.generate_private_key(ec.SECP256R1())
    common_name = authority_name(name)
    certificate = (
        _builder(common_name, _name(common_name), key, BEGIN, now + AUTHORITY_LIFE)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .sign(key, hashes.SHA256())
    )
    return Signer(certificate, key)


def authority_name(swarm: str) -> str:
    """Return the name of the authority of the swarm called `swarm`, limited to the length of a certificate's name."""
    return f"flockwire {swarm}"[:64]


def _builder(
    name: str, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, begin: datetime, end: datetime
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(_name(name))
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(begin)
        .not_valid_after(end)
    )


def _name(common_name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)])


def _general_names(names: tuple[str, ...]) -> Iterator[x509.GeneralName]:
    for name in names:
        try:
            yield x509.IPAddress(ipaddress.ip_address(name))
        except ValueError:
            yield x509.DNSName(name)


def _good(plan: Plan, folder: Path, identity: str, now: datetime) -> bool:
    """Return whether the certificate on disk is good: complete, of its authority, with all names, not expiring."""
    try:
        authority = x509.load_pem_x509_certificate((folder / f"{plan.issuer(identity)}.crt").read_bytes())
        certificate = x509.load_pem_x509_certificate((folder / f"{identity}.crt").read_bytes())
        key = serialization.load_pem_private_key((folder / f"{identity}.key").read_bytes(), None)
        certificate.verify_directly_issued_by(authority)
        alternatives = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except (FileNotFoundError, ValueError, TypeError, InvalidSignature, x509.ExtensionNotFound):
        return False
    return (
        _lasts(certificate, now)
        and certificate.subject == _name(identity)
        and certificate.public_key() == key.public_key()
        and set(alternatives) == set(_general_names(alternative_names(plan, identity)))
        and (folder / f"{identity}.key").stat().st_mode & 0o077 == 0
    )


def _lasts(certificate: x509.Certificate, now: datetime) -> bool:
    """Return whether a certificate is valid, and for long; one made while a clock was ahead is not valid yet."""
    return certificate.not_valid_before_utc <= now and certificate.not_valid_after_utc - now > RENEW


def _write(path: Path, data: bytes, private: bool = False) -> None:
    """Write a file atomically, readable only by its owner if it is private."""
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    part = path.with_name(f".{path.name}.{secrets.token_hex(8)}")
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW
    with os.fdopen(os.open(part, flags, 0o600 if private else 0o644), "wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    part.replace(path)
