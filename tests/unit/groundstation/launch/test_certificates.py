"""Certificates: what OpenSSL says of them, who may read them, and that nothing is overwritten."""

import datetime
import errno
import os
import ssl
import stat

import pytest
from cryptography import x509
from cryptography.x509.verification import PolicyBuilder, Store, VerificationError

from groundstation.declarations.errors import UsageError
from groundstation.launch import certificates
from groundstation.launch.certificates import make_all, make_client
from groundstation.launch.guests import OPERATOR

NOW = datetime.datetime(2026, 11, 29, 12, tzinfo=datetime.UTC)
HOSTS = ("lab-pc.local", "192.168.1.20", "fe80::1")


def certificate(path):
    return x509.load_pem_x509_certificate(path.read_bytes())


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "certificates"
    make_all(made, HOSTS, NOW)
    return made


@pytest.fixture
def store(folder):
    return Store([certificate(folder / "ca.pem")])


@pytest.mark.parametrize("host", ["localhost", *HOSTS[:1]])
def test_the_server_is_who_it_is_called(folder, store, host):
    verifier = PolicyBuilder().store(store).time(NOW).build_server_verifier(x509.DNSName(host))
    assert verifier.verify(certificate(folder / "server.pem"), [])


@pytest.mark.parametrize("host", ["elsewhere.local", "lab-pc.local.evil.org"])
def test_the_server_is_nobody_else(folder, store, host):
    verifier = PolicyBuilder().store(store).time(NOW).build_server_verifier(x509.DNSName(host))
    with pytest.raises(VerificationError):
        verifier.verify(certificate(folder / "server.pem"), [])


def test_addresses_are_addresses(folder):
    found = certificate(folder / "server.pem").extensions.get_extension_for_class(x509.SubjectAlternativeName)
    addresses = {str(address) for address in found.value.get_values_for_type(x509.IPAddress)}
    assert addresses == {"127.0.0.1", "::1", "192.168.1.20", "fe80::1"}


@pytest.mark.parametrize(("day", "is_valid"), [(-1, False), (0, True), (824, True), (826, False)])
def test_how_long_a_server_lasts(folder, store, day, is_valid):
    moment = NOW + datetime.timedelta(days=day)
    verifier = PolicyBuilder().store(store).time(moment).build_server_verifier(x509.DNSName("localhost"))
    if is_valid:
        verifier.verify(certificate(folder / "server.pem"), [])
    else:
        with pytest.raises(VerificationError):
            verifier.verify(certificate(folder / "server.pem"), [])


@pytest.mark.parametrize("role", ["observer", "operator"])
def test_a_client_is_its_role(folder, role):
    found = certificate(folder / f"{role}.pem")
    names = found.subject.get_attributes_for_oid(x509.NameOID.COMMON_NAME)
    assert [name.value for name in names] == [role]
    found.verify_directly_issued_by(certificate(folder / "ca.pem"))


def test_openssl_takes_every_pair(folder):
    for name in ("ca", "server", "observer", "operator"):
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(folder / f"{name}.pem", folder / f"{name}.key")
        context.load_verify_locations(folder / "ca.pem")


def test_they_are_for_the_owners_eyes_only(folder):
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert {stat.S_IMODE(path.stat().st_mode) for path in folder.iterdir()} == {0o600}
    assert len(list(folder.iterdir())) == 8


def test_nothing_is_overwritten_and_nothing_is_left_half(folder):
    before = {path: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(UsageError, match=r"ca\.pem is there already"):
        make_all(folder, (), NOW)
    assert {path: path.read_bytes() for path in folder.iterdir()} == before
    for path in folder.iterdir():
        if path.name != "operator.key":
            path.unlink()
    with pytest.raises(UsageError, match=r"operator\.key is there already"):
        make_all(folder, (), NOW)
    assert [path.name for path in folder.iterdir()] == ["operator.key"]


def test_a_full_disk_leaves_no_folder_that_was_not_there(monkeypatch, tmp_path):
    written = iter((0, 0, errno.ENOSPC))

    def opened(*arguments):
        if code := next(written):
            raise OSError(code, os.strerror(code))
        return os_open(*arguments)

    os_open = os.open
    monkeypatch.setattr(certificates.os, "open", opened)
    with pytest.raises(UsageError, match="new: No space left on device"):
        make_all(tmp_path / "new", (), NOW)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("host", ["", "a b", "lab/pc", "x" * 300, "-lab", "lab..pc"])
def test_a_host_that_is_none_is_refused_by_its_name(tmp_path, host):
    with pytest.raises(UsageError, match="--host"):
        make_all(tmp_path / "new", (host,), NOW)
    assert not (tmp_path / "new").exists()


def test_one_more_client_is_signed_by_the_same_authority(folder):
    written = make_client(folder, OPERATOR, "anna", NOW)
    assert [path.name for path in written] == ["anna.pem", "anna.key"]
    found = certificate(folder / "anna.pem")
    found.verify_directly_issued_by(certificate(folder / "ca.pem"))
    assert found.subject.rfc4514_string() == "CN=operator,OU=anna,O=ground station"
    with pytest.raises(UsageError, match="already"):
        make_client(folder, OPERATOR, "anna", NOW)


@pytest.mark.parametrize("name", ["", "../anna", "a/b", "x" * 65, "anna.pem"])
def test_a_client_whose_name_is_no_files_is_refused(folder, name):
    with pytest.raises(UsageError, match="cannot name a file"):
        make_client(folder, OPERATOR, name, NOW)


def test_an_authority_that_is_missing_or_garbled_is_named(folder, tmp_path):
    with pytest.raises(UsageError, match=r"ca\.pem: No such file"):
        make_client(tmp_path / "nowhere", OPERATOR, "anna", NOW)
    (folder / "ca.key").write_text("nonsense")
    with pytest.raises(UsageError, match="are no certificate and key"):
        make_client(folder, OPERATOR, "anna", NOW)


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="file"):
        make_all(tmp_path / "file" / "certificates", (), NOW)


def test_the_command_names_what_it_has_written(tmp_path, groundstation):
    out = tmp_path / "made"
    shown = groundstation("certificates", "--out", out, "--host", "lab-pc.local")
    assert shown.output.split() == [
        str(out / f"{name}{suffix}")
        for name in ("ca", "server", "observer", "operator")
        for suffix in (".pem", ".key")
    ]
    more = groundstation("certificates", "--out", out, "--client", "anna", "--role", "operator")
    assert more.output.split() == [str(out / "anna.pem"), str(out / "anna.key")]
    with pytest.raises(UsageError, match="--host goes with"):
        groundstation("certificates", "--out", out, "--client", "bob", "--host", "x")
