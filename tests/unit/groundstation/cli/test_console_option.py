"""How the console of a run is reached: free ports, certificates, what is refused."""

import datetime
import ipaddress
import socket
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from groundstation.cli import console_option
from groundstation.cli.console_option import console_access
from groundstation.declarations.errors import UsageError

HOST = "127.0.0.1"


def make_server(folder: Path) -> None:
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "station")])
    now = datetime.datetime(2026, 1, 1, tzinfo=datetime.UTC)
    names = x509.SubjectAlternativeName(
        [x509.DNSName("station.lab"), x509.IPAddress(ipaddress.ip_address("192.168.1.5"))]
    )
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(now)
        .not_valid_after(now + datetime.timedelta(days=3650))
        .add_extension(names, critical=False)
        .sign(key, hashes.SHA256())
    )
    (folder / "server.pem").write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    (folder / "server.key").write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        )
    )


def test_a_port_that_is_taken_is_passed_over() -> None:
    with socket.socket() as taken:
        taken.bind((HOST, 0))
        taken.listen()
        port = taken.getsockname()[1]
        found = console_access(HOST, port, None)
    assert found.port > port
    assert found.address == f"http://{HOST}:{found.port}/"
    assert found.greeting == (f"console: {found.address}",)


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
def test_a_network_is_not_let_in_without_certificates(host: str) -> None:
    with pytest.raises(UsageError, match="needs TLS: make certificates with `groundstation certificates`"):
        console_access(host, 8400, None)


@pytest.mark.parametrize("host", ["192.0.2.1", "a..b", "[::1]", ""])
def test_a_host_that_is_none_of_this_machine_is_refused_in_a_sentence(host: str) -> None:
    with pytest.raises(UsageError, match=r"is no address of this machine .* with --console-host"):
        console_access(host, 8400, None)


def test_where_no_port_is_free_it_says_which_were_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as taken:
        taken.bind((HOST, 0))
        taken.listen()
        port = taken.getsockname()[1]
        monkeypatch.setattr(console_option, "PORTS_TRIED", 1)
        with pytest.raises(UsageError, match=f"no port from {port} to {port} of {HOST} is free"):
            console_access(HOST, port, None)


def test_a_folder_without_certificates_is_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"server\.pem is not there"):
        console_access(HOST, 8400, tmp_path)
    for name in ("server.pem", "server.key"):
        (tmp_path / name).write_text("no certificate")
    with pytest.raises(UsageError, match="is no certificate"):
        console_access(HOST, 8400, tmp_path)


def test_with_certificates_each_role_has_its_address_and_the_names_of_the_certificate_count(
    tmp_path: Path,
) -> None:
    make_server(tmp_path)
    found = console_access(HOST, 8400, tmp_path)
    assert found.address.startswith("https://")
    assert found.operator != found.observer
    assert found.operator in found.greeting[0]
    assert found.observer in found.greeting[1]
    for name in ("station.lab:8400", "192.168.1.5:8400"):
        assert not found.foreign({"host": name, "origin": f"https://{name}"})
    assert found.foreign({"host": "elsewhere.lab:8400"})
