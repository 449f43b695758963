"""Certificates for the console's TLS and for hosts that join the bus: an authority, a server, clients.

Keys are ECDSA on P-256. A client's common name is its role, which the hub's access control goes by; whose it
is stands in the organisational unit.
"""

import datetime
import ipaddress
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from groundstation.declarations.errors import UsageError
from groundstation.launch.guests import ROLES

AUTHORITY, SERVER = "ca", "server"
CERTIFICATE, KEY = ".pem", ".key"
AUTHORITY_DAYS, DAYS = 3650, 825
"""Browsers refuse server certificates of a longer life than 825 days."""
ALWAYS = ("localhost", "127.0.0.1", "::1")
"""Names of the server, whatever else it is called."""
_ORGANISATION = "ground station"
_LONGEST_NAME = 64  # of a common name, X.520


@dataclass(frozen=True)
class _Authority:
    """What signs."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey


def make_all(folder: Path, hosts: Iterable[str], now: datetime.datetime) -> list[Path]:
    """Make an authority, a server and a client of each role.

    Args:
        folder: Where they are written; made if it is not there.
        hosts: Names and addresses that the server is reached by, besides this machine's own.
        now: UTC; they are valid from an hour before.

    Raises:
        UsageError: A file is there already, or a name is none; nothing is written then.
    """
    names = _names([*ALWAYS, *hosts])
    authority = _authority(now)
    files = dict(_files(AUTHORITY, authority.certificate, authority.key))
    files |= _signed(authority, SERVER, SERVER, "", names, now)
    for role in ROLES:
        files |= _signed(authority, role, role, "", (), now)
    return _write(folder, files)


def make_client(folder: Path, role: str, whose: str, now: datetime.datetime) -> list[Path]:
    """Make one more client, signed by the authority in the folder.

    Args:
        folder: Of the authority.
        role: Of the client.
        whose: Name of a person or a host; names the files.
        now: UTC.

    Raises:
        UsageError: There is no authority that can be read, the name is none, or the files are there already.
    """
    if not whose.replace("-", "").replace("_", "").isalnum() or len(whose) > _LONGEST_NAME:
        raise UsageError(f"{whose!r} cannot name a file: expected letters, digits, - and _")
    authority = _read_authority(folder)
    return _write(folder, _signed(authority, whose, role, whose, (), now))


def _authority(now: datetime.datetime) -> _Authority:
    key = ec.generate_private_key(ec.SECP256R1())
    name = _name("ground station authority", "")
    certificate = (
        _builder(name, name, key, now, AUTHORITY_DAYS)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs_certificates=True), critical=True)
        .sign(key, hashes.SHA256())
    )
    return _Authority(certificate, key)


def _signed(
    authority: _Authority,
    file: str,
    common_name: str,
    whose: str,
    names: Iterable[x509.GeneralName],
    now: datetime.datetime,
) -> dict[str, bytes]:
    """Files of a certificate and its key; with names it is a server's."""
    key = ec.generate_private_key(ec.SECP256R1())
    listed = list(names)
    purpose = ExtendedKeyUsageOID.SERVER_AUTH if listed else ExtendedKeyUsageOID.CLIENT_AUTH
    builder = (
        _builder(_name(common_name, whose), authority.certificate.subject, key, now, DAYS)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs_certificates=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage([purpose]), critical=False)
        .add_extension(
            x509.AuthorityKeyIdentifier.from_issuer_public_key(authority.key.public_key()), critical=False
        )
    )
    if listed:
        builder = builder.add_extension(x509.SubjectAlternativeName(listed), critical=False)
    return dict(_files(file, builder.sign(authority.key, hashes.SHA256()), key))


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, now: datetime.datetime, days: int
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(hours=1))  # clocks of other hosts may be behind
        .not_valid_after(now + datetime.timedelta(days=days))
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
    )


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def _name(common: str, whose: str) -> x509.Name:
    parts = [x509.NameAttribute(NameOID.ORGANIZATION_NAME, _ORGANISATION)]
    if whose:
        parts.append(x509.NameAttribute(NameOID.ORGANIZATIONAL_UNIT_NAME, whose))
    return x509.Name([*parts, x509.NameAttribute(NameOID.COMMON_NAME, common)])


def _names(hosts: Iterable[str]) -> list[x509.GeneralName]:
    """Addresses as addresses and names as names, each once."""
    found: dict[str, x509.GeneralName] = {}
    for host in hosts:
        with suppress(ValueError):
            found[host] = x509.IPAddress(ipaddress.ip_address(host))
            continue
        parts = host.rstrip(".").split(".")
        if len(host) > 253 or not all(_is_label(part) for part in parts):
            raise UsageError(f"--host {host!r} is no name and no address of a host")
        found[host] = x509.DNSName(host.rstrip("."))
    return list(found.values())


def _is_label(text: str) -> bool:
    plain = text.replace("-", "").replace("_", "")
    return plain.isascii() and plain.isalnum() and len(text) < 64 and not text.startswith("-")


def _files(
    name: str, certificate: x509.Certificate, key: ec.EllipticCurvePrivateKey
) -> Iterator[tuple[str, bytes]]:
    yield f"{name}{CERTIFICATE}", certificate.public_bytes(serialization.Encoding.PEM)
    yield (
        f"{name}{KEY}",
        key.private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        ),
    )


def _read_authority(folder: Path) -> _Authority:
    paths = folder / f"{AUTHORITY}{CERTIFICATE}", folder / f"{AUTHORITY}{KEY}"
    try:
        certificate = x509.load_pem_x509_certificate(paths[0].read_bytes())
        key = serialization.load_pem_private_key(paths[1].read_bytes(), None)
    except OSError as error:
        raise UsageError(
            f"{error.filename}: {error.strerror}: make an authority first, without --client"
        ) from error
    except (ValueError, TypeError) as error:
        raise UsageError(f"{paths[0]} and {paths[1]} are no certificate and key: {error}") from error
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise UsageError(f"{paths[1]} is a {type(key).__name__}, expected a key of an elliptic curve")
    return _Authority(certificate, key)


def _write(folder: Path, files: Mapping[str, bytes]) -> list[Path]:
    """Write all or nothing; nobody else may read them, and nothing is overwritten."""
    is_made_here = not folder.exists()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{folder} cannot be made: {error.strerror}") from error
    written: list[Path] = []
    try:
        for name, content in files.items():
            path = folder / name
            descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            written.append(path)
            with os.fdopen(descriptor, "wb") as file:
                file.write(content)
    except OSError as error:
        for path in written:
            path.unlink(missing_ok=True)
        if is_made_here:
            folder.rmdir()
        if isinstance(error, FileExistsError):
            raise UsageError(
                f"{error.filename} is there already: certificates are not overwritten, name another folder"
            ) from error
        raise UsageError(f"{error.filename or folder}: {error.strerror}") from error
    return written
