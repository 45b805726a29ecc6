"""DDS Security for CycloneDDS in lab/bench/transport.py: what protects its messages as mutual TLS does flockwire's.

Every participant has a certificate of the swarm's authority, every message is encrypted and authenticated for each of
its receivers, so that none of them can send in another's name. The documents are those of OMG's DDS Security 1.1,
sections 9.4.1.2 (governance) and 9.4.1.3 (permissions). The wheel has no plug-ins: they are Debian's, for its version.
"""

from __future__ import annotations

from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.hazmat.primitives.serialization.pkcs7 import PKCS7Options, PKCS7SignatureBuilder
from flockwire_core.security.files import Credentials
from flockwire_core.security.pki import read_authority

BUILT_FOR = "0.10.2"  # Debian's version, of plug-ins and binding
PLUGINS = "libddsc0debian/libdds_security_{}.so"
GOVERNANCE, PERMISSIONS = "governance", "permissions"
ALL = "<domains><id_range><min>0</min><max>230</max></id_range></domains>"
RULES = f"""<domain_access_rules><domain_rule>{ALL}
<allow_unauthenticated_participants>false</allow_unauthenticated_participants>
<enable_join_access_control>true</enable_join_access_control>
<discovery_protection_kind>NONE</discovery_protection_kind>
<liveliness_protection_kind>NONE</liveliness_protection_kind>
<rtps_protection_kind>ENCRYPT_WITH_ORIGIN_AUTHENTICATION</rtps_protection_kind>
<topic_access_rules><topic_rule><topic_expression>*</topic_expression>
<enable_discovery_protection>false</enable_discovery_protection>
<enable_liveliness_protection>false</enable_liveliness_protection>
<enable_read_access_control>false</enable_read_access_control>
<enable_write_access_control>false</enable_write_access_control>
<metadata_protection_kind>NONE</metadata_protection_kind><data_protection_kind>NONE</data_protection_kind>
</topic_rule></topic_access_rules></domain_rule></domain_access_rules>"""
GRANT = f"""<grant name="{{0}}"><subject_name>CN={{0}}</subject_name>
<validity><not_before>2020-01-01T00:00:00</not_before><not_after>2120-01-01T00:00:00</not_after></validity>
<allow_rule>{ALL}<publish><topics><topic>*</topic></topics></publish>
<subscribe><topics><topic>*</topic></topics></subscribe></allow_rule><default>DENY</default></grant>"""
DOCUMENT = """<?xml version="1.0" encoding="utf-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_{}.xsd">{}</dds>
"""


def lacking() -> str:
    """Return what must be installed first, nothing when all is there."""
    try:
        built = version("cyclonedds") == BUILT_FOR and all(map(_plugin, ("auth", "ac", "crypto")))
    except PackageNotFoundError:
        built = False
    return "" if built else f"cyclonedds=={BUILT_FOR}, built for Debian's (lab/RESULTS.md)"


def sign(folder: Path, names: Iterable[str]) -> None:
    """Write into `folder`, that of the keys, what the swarm's authority allows the identities called `names`."""
    authority = read_authority(folder)
    signing = PKCS7SignatureBuilder().add_signer(authority.certificate, authority.key, SHA256())
    grants = f"<permissions>{''.join(map(GRANT.format, names))}</permissions>"
    for name, content in ((GOVERNANCE, RULES), (PERMISSIONS, grants)):
        text = DOCUMENT.format(name, content).encode()
        options = [PKCS7Options.Text, PKCS7Options.DetachedSignature]
        _signed(folder, name).write_bytes(signing.set_data(text).sign(Encoding.SMIME, options))


def security(files: Credentials) -> str:
    """Return the security of a domain's configuration for the identity of `files`."""
    folder = files.certificate.parent
    return f"""<Security>
<Authentication>{_library("auth", "authentication")}
<IdentityCA>file:{files.authority}</IdentityCA><IdentityCertificate>file:{files.certificate}</IdentityCertificate>
<PrivateKey>file:{files.key}</PrivateKey></Authentication>
<AccessControl>{_library("ac", "access_control")}
<PermissionsCA>file:{files.authority}</PermissionsCA><Governance>file:{_signed(folder, GOVERNANCE)}</Governance>
<Permissions>file:{_signed(folder, PERMISSIONS)}</Permissions></AccessControl>
<Cryptographic>{_library("crypto", "crypto")}</Cryptographic></Security>"""


def _library(name: str, functions: str) -> str:
    called = f'initFunction="init_{functions}" finalizeFunction="finalize_{functions}"'
    return f'<Library path="{_plugin(name)}" {called}/>'


def _plugin(name: str) -> Path | None:
    return next(Path("/usr/lib").glob(f"*-linux-gnu/{PLUGINS.format(name)}"), None)


def _signed(folder: Path, name: str) -> Path:
    return folder / f"{name}.p7s"
