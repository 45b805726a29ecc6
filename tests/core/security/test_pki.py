import ipaddress
import os
import stat
from contextlib import suppress
from datetime import timedelta
from pathlib import Path
from threading import Thread

import pytest
from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID
from flockwire_core.security import pki
from flockwire_core.security.credentials import common_name, load_credentials
from flockwire_core.security.files import CredentialsError, hold
from flockwire_core.security.pki import (
    AUTHORITY_LIFE,
    BEGIN,
    LIFE,
    LOCK,
    RENEW,
    WARN,
    expiring,
    issue,
    make_keys,
    new_authority,
    read_authority,
    save,
)

DAY = timedelta(days=1)
SECOND = timedelta(seconds=1)
TWO_HOSTS = {"hosts": {"ground": {"address": "10.0.0.1"}, "air": {"address": "fd00::7"}}, "drones.2.host": "air"}


def certificate(folder, name):
    return x509.load_pem_x509_certificate((folder / f"{name}.crt").read_bytes())


def checked(folder, plan, identity, now):
    """Return the keys of `identity`, checked as its process does."""
    return load_credentials(folder, identity, now, plan.issuer(identity), plan.authorities)


def alternatives(folder, name):
    """Return the names and addresses that a certificate is good for."""
    found = certificate(folder, name).extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    return {str(entry.value) for entry in found}


def contents(folder):
    """Return the files of a folder of keys, by path; the makers' lock is none of them."""
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != LOCK)
    return {path.relative_to(folder): path.read_bytes() for path in files}


@pytest.fixture
def plan(make_plan):
    return make_plan()


@pytest.mark.parametrize("mode", ["peers", "router"])
def test_every_process_gets_a_certificate_of_its_own_name(make_plan, tmp_path, made, mode):
    plan = make_plan({"network.mode": mode})
    assert make_keys(plan, tmp_path, made) == (*plan.authorities, *plan.identities)
    for identity in plan.identities:
        assert common_name(certificate(tmp_path, identity)) == identity
        assert checked(tmp_path, plan, identity, made)
    names = {f"{name}.{end}" for name in plan.identities for end in ("crt", "key")}
    names |= {name for authority in plan.authorities for name in (f"{authority}.crt", f"authority/{authority}.key")}
    assert {str(path) for path in contents(tmp_path)} == names


def test_a_certificate_serves_both_ends_of_a_link_for_ninety_days(keys, made):
    for name in ("uav1", "operator"):
        held = certificate(keys, name)
        usage = held.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
        assert set(usage) == {ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH}
        assert held.not_valid_after_utc == made + 90 * DAY
        assert held.not_valid_before_utc == BEGIN
        assert not held.extensions.get_extension_for_class(x509.BasicConstraints).value.ca


def test_all_keys_are_of_the_curve_p_256_and_no_two_are_one(keys, plan):
    held = [certificate(keys, name).public_key() for name in (*plan.authorities, *plan.identities)]
    assert all(isinstance(key, ec.EllipticCurvePublicKey) and key.curve.name == "secp256r1" for key in held)
    numbers = {certificate(keys, name).serial_number for name in (*plan.authorities, *plan.identities)}
    assert len({key.public_numbers() for key in held}) == len(numbers) == len(held)


@pytest.mark.parametrize("authority", ["ca", "operators"])
def test_an_authority_signs_processes_or_operators_only_and_no_authority_below_it(keys, authority):
    limits = certificate(keys, authority).extensions.get_extension_for_class(x509.BasicConstraints)
    assert limits.critical
    assert (limits.value.ca, limits.value.path_length) == (True, 0)


def test_a_certificate_is_good_for_its_hosts_addresses_and_names(make_plan, tmp_path, made):
    make_keys(make_plan(TWO_HOSTS), tmp_path, made)
    loopback = {"127.0.0.1", "::1", "localhost"}
    assert alternatives(tmp_path, "gateway") == {"10.0.0.1", "ground", "gateway"} | loopback
    assert alternatives(tmp_path, "uav2") == {"fd00::7", "air", "uav2"} | loopback


@pytest.mark.parametrize("mode", ["peers", "router"])
def test_a_certificate_is_good_for_the_address_where_its_process_is_dialled(make_plan, tmp_path, made, mode):
    plan = make_plan({**TWO_HOSTS, "drones.3.address": "10.0.0.9:9000", "network.mode": mode})
    make_keys(plan, tmp_path, made)
    for identity, endpoint in plan.endpoints.items():
        address = ipaddress.ip_address(endpoint.rpartition(":")[0].strip("[]"))
        assert str(address) in alternatives(tmp_path, identity)


@pytest.mark.parametrize("mask", [0o000, 0o022, 0o077])
def test_private_keys_are_their_owners_alone(plan, tmp_path, made, mask):
    before = os.umask(mask)
    try:
        make_keys(plan, tmp_path / "keys", made)
    finally:
        os.umask(before)
    private = list((tmp_path / "keys").rglob("*.key"))
    assert len(private) == len(plan.authorities) + len(plan.identities)
    assert {stat.S_IMODE(path.stat().st_mode) for path in private} == {0o600}


def test_the_authoritys_key_lies_apart_and_no_process_needs_it(keys, plan, made):
    for key in (keys / "authority").iterdir():
        key.unlink()
    (keys / "authority").rmdir()
    for identity in plan.identities:
        assert checked(keys, plan, identity, made)
    with pytest.raises(FileNotFoundError, match=r"ca\.key: the authority's key is not here"):
        read_authority(keys)


def test_the_folders_of_the_keys_are_their_owners_alone(plan, tmp_path, made):
    make_keys(plan, tmp_path / "flock" / "keys", made)
    for folder in (tmp_path / "flock" / "keys", tmp_path / "flock" / "keys" / "authority"):
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700


@pytest.mark.parametrize("later", [timedelta(), LIFE - RENEW - SECOND])
def test_a_second_time_nothing_is_made(keys, plan, made, later):
    before = contents(keys)
    assert make_keys(plan, keys, made + later) == ()
    assert contents(keys) == before


def test_what_ends_within_thirty_days_is_renewed_by_the_same_authority(keys, plan, made):
    before, later = contents(keys), made + LIFE - RENEW
    assert make_keys(plan, keys, later + SECOND) == plan.identities
    assert (keys / "ca.crt").read_bytes() == before[Path("ca.crt")]
    assert certificate(keys, "uav1").not_valid_after_utc == later + SECOND + LIFE
    for identity in plan.identities:
        assert checked(keys, plan, identity, later)


def test_an_authority_about_to_end_is_replaced_with_all_it_signed(keys, plan, made):
    later = certificate(keys, "ca").not_valid_after_utc - RENEW + SECOND
    assert make_keys(plan, keys, later) == (*plan.authorities, *plan.identities)
    assert load_credentials(keys, "uav1", later)


def test_operators_have_an_authority_of_their_own_that_signs_nobody_else(keys, plan):
    for identity in plan.identities:
        signed = []
        for authority in plan.authorities:
            with suppress(ValueError, InvalidSignature):
                certificate(keys, identity).verify_directly_issued_by(certificate(keys, authority))
                signed.append(authority)
        assert signed == ["operators" if identity in ("operator", "console") else "ca"]


def test_a_folder_from_before_operators_had_an_authority_is_completed(make_plan, plan, tmp_path, made):
    old = make_plan({"network.security": "none"})
    make_keys(old, tmp_path, made)
    assert old.authorities == ("ca",)
    assert make_keys(plan, tmp_path, made) == ("operators", "operator", "console")
    for identity in plan.identities:
        assert checked(tmp_path, plan, identity, made)


def test_a_folder_from_before_without_the_authoritys_key_names_the_remedy(make_plan, plan, tmp_path, made):
    make_keys(make_plan({"network.security": "none"}), tmp_path, made)
    (tmp_path / "authority" / "ca.key").unlink()
    with pytest.raises(CredentialsError, match=r"operators\.crt: has to be made again.*--rotate"):
        make_keys(plan, tmp_path, made)
    with pytest.raises(CredentialsError, match=r"operators\.crt: cannot read it.*`flockwire keys SWARM` makes it"):
        checked(tmp_path, plan, "uav1", made)


def test_what_is_missing_is_made_and_nothing_else(keys, plan, made):
    (keys / "uav2.crt").unlink()
    (keys / "leader.key").unlink()
    assert make_keys(plan, keys, made) == ("leader", "uav2")
    assert load_credentials(keys, "leader", made)


def test_a_host_that_moved_gets_new_certificates(make_plan, tmp_path, made):
    make_keys(make_plan(TWO_HOSTS), tmp_path, made)
    moved = make_plan({**TWO_HOSTS, "hosts": {"ground": {"address": "10.0.0.1"}, "air": {"address": "fd00::8"}}})
    assert make_keys(moved, tmp_path, made) == ("uav2",)
    assert "fd00::8" in alternatives(tmp_path, "uav2")
    assert make_keys(moved, tmp_path, made) == ()


def test_a_swarm_that_grows_gets_what_it_lacks(make_plan, keys, made):
    assert make_keys(make_plan({"network.mode": "router"}), keys, made) == (
        "router",
        "operator",
        "console",
    )  # a router has one authority


def test_rotation_replaces_all_and_makes_the_old_worthless(keys, plan, made):
    old, before = certificate(keys, "uav1"), contents(keys)
    assert make_keys(plan, keys, made, rotate=True) == (*plan.authorities, *plan.identities)
    after = contents(keys)
    assert before.keys() == after.keys()
    assert all(after[path] != before[path] for path in before)
    with pytest.raises((ValueError, InvalidSignature)):
        old.verify_directly_issued_by(certificate(keys, "ca"))
    assert load_credentials(keys, "uav1", made)


def test_while_a_process_holds_the_keys_no_authority_is_made_again(keys, plan, made):
    before = contents(keys)
    with hold(keys):
        with pytest.raises(CredentialsError, match=r"run with these keys.* not even a stop.* end them first"):
            make_keys(plan, keys, made, rotate=True)
        with pytest.raises(CredentialsError, match="run with these keys"):  # nor one that is about to expire
            make_keys(plan, keys, made + AUTHORITY_LIFE)
        assert contents(keys) == before
        (keys / "uav1.crt").unlink()
        assert make_keys(plan, keys, made) == ("uav1",)  # which the others accept
    assert make_keys(plan, keys, made, rotate=True) == (*plan.authorities, *plan.identities)


def test_a_rotation_that_was_cut_short_is_finished_by_the_next_run(keys, plan, made):
    old = {name: (keys / name).read_bytes() for name in ("uav1.crt", "uav1.key", "uav2.crt")}
    make_keys(plan, keys, made, rotate=True)
    for name, data in old.items():  # uav1: nothing new yet; uav2: the new key only
        (keys / name).write_bytes(data)
    assert make_keys(plan, keys, made) == ("uav1", "uav2")
    for identity in plan.identities:
        assert checked(keys, plan, identity, made)


def test_an_authoritys_key_without_its_certificate_signs_nothing(keys, plan, made):
    old = (keys / "ca.crt").read_bytes()
    make_keys(plan, keys, made, rotate=True)
    (keys / "ca.crt").write_bytes(old)
    with pytest.raises(CredentialsError, match=r"is not the key of ca\.crt; --rotate"):
        make_keys(plan, keys, made)


def test_where_the_authoritys_key_is_kept_elsewhere_no_other_authority_is_made(keys, plan, made):
    (keys / "authority" / "ca.key").unlink()
    (keys / "uav1.crt").write_bytes((keys / "uav2.crt").read_bytes())
    before = contents(keys)
    with pytest.raises(CredentialsError, match=r"ca\.key"):
        make_keys(plan, keys, made)
    assert contents(keys) == before


def test_without_the_authoritys_key_what_is_good_stays(keys, plan, made):
    (keys / "authority" / "ca.key").unlink()
    before = contents(keys)
    assert make_keys(plan, keys, made) == ()
    assert contents(keys) == before


def test_what_a_crash_left_behind_does_not_open_a_key_to_others(plan, tmp_path, made):
    for name in ("uav1.key.part", "uav2.key.part"):
        (tmp_path / name).touch(0o644)
    make_keys(plan, tmp_path, made)
    assert {stat.S_IMODE(path.stat().st_mode) for path in tmp_path.rglob("*.key")} == {0o600}


def test_no_key_is_written_through_a_link(plan, tmp_path, made):
    (tmp_path / "keys").mkdir()
    (tmp_path / "keys" / "uav1.key.part").symlink_to(tmp_path / "elsewhere")
    make_keys(plan, tmp_path / "keys", made)
    assert not (tmp_path / "elsewhere").exists()
    assert not (tmp_path / "keys" / "uav1.key").is_symlink()


def test_two_concurrent_key_makers_leave_valid_keys(plan, tmp_path, made):
    failures = []

    def work():
        try:
            make_keys(plan, tmp_path, made)
        except Exception as error:
            failures.append(error)

    for _ in range(3):
        threads = [Thread(target=work) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert failures == []
        for identity in plan.identities:
            assert checked(tmp_path, plan, identity, made)
        for path in list(tmp_path.rglob("*.*")):
            path.unlink()


def test_a_swarm_with_the_longest_name_gets_keys(make_plan, tmp_path, made):
    plan = make_plan({"name": "a" * 64})
    make_keys(plan, tmp_path, made)
    assert load_credentials(tmp_path, "uav1", made)


def test_a_foreign_certificate_is_replaced(keys, plan, made):
    (keys / "uav1.crt").write_bytes((keys / "ca.crt").read_bytes())  # it names no addresses
    assert make_keys(plan, keys, made) == ("uav1",)
    assert load_credentials(keys, "uav1", made)


def test_junk_in_place_of_a_key_is_an_error_that_the_command_line_knows(keys, plan, made):
    (keys / "authority" / "ca.key").write_text("junk")
    with pytest.raises(ValueError, match=r"PEM|deserialize"):
        make_keys(plan, keys, made)


def test_an_authoritys_key_with_a_password_is_an_error_that_the_command_line_knows(keys, plan, made):
    locked = read_authority(keys).key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.BestAvailableEncryption(b"password"),
    )
    (keys / "authority" / "ca.key").write_bytes(locked)
    with pytest.raises(ValueError, match="encrypted"):
        make_keys(plan, keys, made)


def test_two_weeks_before_its_end_a_certificate_gives_a_warning(keys, plan, made):
    assert list(expiring(plan, keys, made + LIFE - WARN)) == []
    warned = list(expiring(plan, keys, made + LIFE - WARN + SECOND))
    assert warned[0] == f"{keys / 'gateway.crt'}: ends on 2027-02-19; `flockwire keys` renews it"
    assert len(warned) == len(plan.identities)
    assert list(expiring(plan, keys, made + 2 * LIFE)) == warned  # it has ended: all the more


def test_the_authoritys_end_gives_a_warning_too(keys, plan, made):
    end = certificate(keys, "ca").not_valid_after_utc
    assert any(str(keys / "ca.crt") in line for line in expiring(plan, keys, end - WARN + SECOND))


def test_where_there_are_no_keys_nothing_gives_a_warning(plan, tmp_path, made):
    assert list(expiring(plan, tmp_path / "nowhere", made)) == []


def test_a_certificate_that_cannot_be_read_is_a_warning_not_an_error(keys, plan, made):
    (keys / "uav1.crt").write_text("junk")
    assert any("uav1.crt" in line for line in expiring(plan, keys, made))


def test_a_certificate_of_any_name_and_dates_can_be_made_for_tests_of_others(tmp_path, made):
    authority = new_authority("flock", made)
    save(issue(authority, "uav1", ("localhost",), made - DAY, made + DAY), tmp_path, "forged")
    assert common_name(certificate(tmp_path, "forged")) == "uav1"
    certificate(tmp_path, "forged").verify_directly_issued_by(authority.certificate)
    assert stat.S_IMODE((tmp_path / "forged.key").stat().st_mode) == 0o600


def test_a_certificate_that_may_not_be_read_is_a_warning_with_its_cause(keys, plan, made):
    (keys / "uav1.crt").unlink()
    (keys / "uav1.crt").mkdir()
    assert f"{keys / 'uav1.crt'}: cannot read it: Is a directory" in expiring(plan, keys, made)


def test_certificates_that_are_not_valid_yet_are_made_again_the_authorities_too(plan, tmp_path, made, monkeypatch):
    with monkeypatch.context() as earlier:  # certificates once began at the time of a clock, which may be ahead
        earlier.setattr(pki, "BEGIN", made + 2 * DAY)
        make_keys(plan, tmp_path, made + 2 * DAY)
    assert len(tuple(expiring(plan, tmp_path, made))) == len((*plan.authorities, *plan.identities))
    assert all("is valid from 2026-11-23 12:00 UTC on" in line for line in expiring(plan, tmp_path, made))
    assert set(make_keys(plan, tmp_path, made)) == {*plan.authorities, *plan.identities}
    for identity in plan.identities:
        assert checked(tmp_path, plan, identity, made)
    assert make_keys(plan, tmp_path, made) == ()


def test_without_the_authoritys_key_certificates_from_the_future_are_not_good(plan, tmp_path, made, monkeypatch):
    with monkeypatch.context() as earlier:
        earlier.setattr(pki, "BEGIN", made + 2 * DAY)
        make_keys(plan, tmp_path, made + 2 * DAY)
    for key in (tmp_path / "authority").iterdir():
        key.unlink()
    with pytest.raises(CredentialsError, match="has to be made again"):
        make_keys(plan, tmp_path, made)
