"""Keys that cannot be used are told in one line, with the file and the cure."""

import errno
import os
from datetime import timedelta
from pathlib import Path
from shutil import copyfile

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from flockwire_core.security.credentials import load_credentials
from flockwire_core.security.files import Credentials, CredentialsError, default_folder
from flockwire_core.security.pki import BEGIN, FLIGHT, LIFE, Signer, issue, new_authority, read_authority, save

CHOWN = "`chown -R` the keys folder to the user who runs this"
DAY, MINUTE = timedelta(days=1), timedelta(minutes=1)


def refusal(folder, now, identity="uav1"):
    """Return the one line that refuses these keys."""
    with pytest.raises(CredentialsError) as refused:
        load_credentials(folder, identity, now)
    text = str(refused.value)
    assert "\n" not in text
    return text


def replace(path, data):
    path.unlink()
    path.write_bytes(data)
    path.chmod(0o600)


def test_good_keys_are_three_files(keys, made):
    files = Credentials(keys / "ca.crt", keys / "uav1.crt", keys / "uav1.key")
    assert load_credentials(keys, "uav1", made) == files


def test_the_default_folder_is_the_swarms_own_beside_its_file():
    assert default_folder("flock", Path("swarms")) == Path("swarms/.flockwire/flock/keys")


def test_a_missing_folder(tmp_path, made):
    line = refusal(tmp_path / "nowhere", made)
    assert line == f"{tmp_path / 'nowhere'}: there is no such keys folder; `flockwire keys SWARM` makes it"


def test_a_file_in_place_of_the_folder(tmp_path, made):
    (tmp_path / "keys").touch()
    assert refusal(tmp_path / "keys", made).startswith(f"{tmp_path / 'keys'}: there is no such keys folder; ")


@pytest.mark.parametrize("name", ["ca.crt", "uav1.crt", "uav1.key"])
def test_a_missing_file(keys, made, name):
    (keys / name).unlink()
    line = refusal(keys, made)
    assert line == f"{keys / name}: cannot read it: No such file or directory; `flockwire keys SWARM` makes it"


@pytest.mark.parametrize("name", ["ca.crt", "uav1.crt", "uav1.key"])
def test_a_file_that_may_not_be_read(keys, made, name, monkeypatch):
    read = Path.read_bytes

    def refuse(path):
        if path.name == name:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        return read(path)

    monkeypatch.setattr(Path, "read_bytes", refuse)
    assert refusal(keys, made) == f"{keys / name}: cannot read it: Permission denied; {CHOWN}"


def test_a_folder_that_may_not_be_searched(keys, made, monkeypatch):
    stat = Path.stat

    def refuse(path, **options):
        if path == keys:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        return stat(path, **options)

    monkeypatch.setattr(Path, "stat", refuse)
    assert refusal(keys, made) == f"{keys}: cannot read this keys folder: Permission denied; {CHOWN}"


@pytest.mark.parametrize("name", ["ca.crt", "uav1.crt", "uav1.key"])
def test_a_folder_in_place_of_a_file(keys, made, name):
    (keys / name).unlink()
    (keys / name).mkdir()
    assert refusal(keys, made).startswith(f"{keys / name}: cannot read it: Is a directory; ")


@pytest.mark.parametrize("junk", [b"", b"junk\n", b"\xff\xfe\0", b"-----BEGIN CERTIFICATE-----\nAAAA\n"])
@pytest.mark.parametrize(
    ("name", "what"),
    [("ca.crt", "a certificate in PEM form"), ("uav1.crt", "a certificate"), ("uav1.key", "a private key in PEM form")],
)
def test_a_file_that_is_not_pem(keys, made, name, what, junk):
    replace(keys / name, junk)
    assert refusal(keys, made).startswith(f"{keys / name}: is not {what}")


@pytest.mark.parametrize("name", ["uav1.crt", "uav1.key"])
def test_a_file_that_was_cut_off(keys, made, name):
    replace(keys / name, (keys / name).read_bytes()[:-60])
    assert refusal(keys, made).startswith(f"{keys / name}: is not a ")


def test_a_key_in_place_of_the_certificate(keys, made):
    replace(keys / "uav1.crt", (keys / "uav1.key").read_bytes())
    assert refusal(keys, made).startswith(f"{keys / 'uav1.crt'}: is not a certificate")


def test_a_key_with_a_password(keys, made):
    key = serialization.load_pem_private_key((keys / "uav1.key").read_bytes(), None)
    locked = key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.BestAvailableEncryption(b"password"),
    )
    replace(keys / "uav1.key", locked)
    assert refusal(keys, made) == f"{keys / 'uav1.key'}: is not a private key in PEM form, without a password"


@pytest.mark.parametrize("mode", [0o604, 0o640, 0o610, 0o602, 0o666, 0o777])
def test_a_key_that_others_may_touch(keys, made, mode):
    (keys / "uav1.key").chmod(mode)
    line = refusal(keys, made)
    assert line == f"{keys / 'uav1.key'}: others may read this private key (mode {mode:04o}); chmod 600 it"


@pytest.mark.parametrize("mode", [0o600, 0o400, 0o700])
def test_a_key_that_only_its_owner_may_touch(keys, made, mode):
    (keys / "uav1.key").chmod(mode)
    assert load_credentials(keys, "uav1", made)


def test_a_certificate_and_a_key_of_two_processes(keys, made):
    replace(keys / "uav1.key", (keys / "uav2.key").read_bytes())
    assert refusal(keys, made) == f"{keys / 'uav1.crt'}: does not belong to the key uav1.key beside it"


def test_another_processes_certificate(keys, made):
    for end in ("crt", "key"):
        replace(keys / f"uav1.{end}", (keys / f"uav2.{end}").read_bytes())
    assert refusal(keys, made) == f"{keys / 'uav1.crt'}: is for 'uav2', this process is 'uav1'"


def test_a_certificate_for_nobody(keys, made):
    key = ec.generate_private_key(ec.SECP256R1())
    nobody = x509.Name([])
    certificate = x509.CertificateBuilder(nobody, nobody, key.public_key(), 1, made - DAY, made + DAY).sign(
        key, hashes.SHA256()
    )
    save(Signer(certificate, key), keys, "uav1")
    assert refusal(keys, made).startswith(f"{keys / 'uav1.crt'}: is for ")


@pytest.mark.parametrize("name", ["flock", "another"])
def test_another_authoritys_certificate(keys, made, name):
    foreign = new_authority(name, made)  # of the same name, too
    save(issue(foreign, "uav1", ("localhost",), made - DAY, made + DAY), keys, "uav1")
    line = refusal(keys, made)
    assert line == f"{keys / 'uav1.crt'}: was not signed by the authority {keys / 'ca.crt'}"


def test_another_processes_certificate_in_place_of_the_authoritys(keys, made):
    copyfile(keys / "uav2.crt", keys / "ca.crt")
    assert "was not signed by the authority" in refusal(keys, made)


def test_an_expired_certificate(keys, made):
    assert load_credentials(keys, "uav1", made + LIFE)
    line = refusal(keys, made + LIFE + MINUTE)
    assert line == f"{keys / 'uav1.crt'}: expired on 2027-02-19 12:00 UTC; `flockwire keys SWARM` renews it"


def test_an_expired_authority(keys, made):
    authority = read_authority(keys)
    late = authority.certificate.not_valid_after_utc + DAY
    save(issue(authority, "uav1", ("localhost",), made, late + DAY), keys, "uav1")
    assert refusal(keys, late).startswith(f"{keys / 'ca.crt'}: expired on ")


def test_a_clock_that_was_set_back_by_years_ends_no_link(keys):
    assert load_credentials(keys, "uav1", BEGIN)


def test_a_flight_needs_certificates_that_last_some_hours(keys, made):
    end = made + LIFE
    assert load_credentials(keys, "uav1", end - FLIGHT, lasting=FLIGHT)
    assert load_credentials(keys, "uav1", end)  # who restarts in flight needs no more
    with pytest.raises(CredentialsError, match="expires on 2027-02-19 12:00 UTC, and a flight needs 12 h; "):
        load_credentials(keys, "uav1", end - FLIGHT + MINUTE, lasting=FLIGHT)


def test_a_clock_before_the_certificates_time(keys, made):
    save(issue(read_authority(keys), "uav1", ("localhost",), made, made + DAY), keys, "uav1")
    assert refusal(keys, made - DAY) == (
        f"{keys / 'uav1.crt'}: is valid from 2026-11-21 12:00 UTC on, and this machine's clock says "
        "2026-11-20 12:00 UTC; set the clock, or if it is right, `flockwire keys SWARM` makes it again"
    )
