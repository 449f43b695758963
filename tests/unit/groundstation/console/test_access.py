"""Who may ask: roles, tokens, foreign pages."""

import asyncio

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from groundstation.console.access import Access, Role, new_token
from groundstation.console.desk import NotAllowedError
from groundstation.console.lease_office import LeaseOffice
from groundstation.console.tokens import Tokens

LAN = Access("192.168.1.5", 8400, ("station.lab",), "looks", "flies", "server.pem", "server.key")


def test_on_loopback_everybody_at_the_machine_is_an_operator() -> None:
    assert Access().role({}, "", "") is Role.OPERATOR


@pytest.mark.parametrize(
    ("headers", "cookie", "token", "role"),
    [
        ({}, "", "", Role.NOBODY),
        ({}, "", "guessed", Role.NOBODY),
        ({}, "", "looks", Role.OBSERVER),
        ({}, "flies", "", Role.OPERATOR),
        ({"authorization": "Bearer flies"}, "", "", Role.OPERATOR),
        ({"authorization": "Bearer "}, "", "", Role.NOBODY),
        ({}, "", "flïes", Role.NOBODY),
    ],
)
def test_on_a_network_a_token_gives_the_role(
    headers: dict[str, str], cookie: str, token: str, role: Role
) -> None:
    assert LAN.role(headers, cookie, token) is role


@pytest.mark.parametrize(
    "headers",
    [
        {"host": "evil.example:8400"},
        {"host": "127.0.0.1:8400", "origin": "http://evil.example"},
        {"host": "127.0.0.1:8400", "origin": "http://127.0.0.1:9000"},
        {"host": "127.0.0.1:8400", "origin": "null"},
        {"host": "127.0.0.1:8400", "sec-fetch-site": "cross-site"},
        {"host": "127.0.0.1:8400", "sec-fetch-site": "same-site"},
        {},
    ],
)
def test_what_another_page_makes_a_browser_send_is_foreign(headers: dict[str, str]) -> None:
    assert Access().foreign(headers)


@pytest.mark.parametrize("host", ["127.0.0.1:8400", "localhost:8400", "[::1]:8400"])
def test_its_own_pages_are_not(host: str) -> None:
    assert not Access().foreign({"host": host, "origin": f"http://{host}", "sec-fetch-site": "same-origin"})
    assert not Access().foreign({"host": host})


@pytest.mark.parametrize(
    "access",
    [
        Access("0.0.0.0"),
        Access("192.168.1.5", observer="a", operator="b"),
        Access("192.168.1.5", certificate="a", key="b"),
    ],
)
def test_a_network_is_not_let_in_without_tokens_and_tls(access: Access) -> None:
    assert access.trouble()


def test_a_network_is_let_in_with_both() -> None:
    assert not LAN.trouble()
    assert len({new_token() for _ in range(50)}) == 50


@given(st.text(max_size=40))
def test_a_token_shows_its_name_to_every_console_of_the_run_and_to_no_other(name: str) -> None:
    token = Tokens(b"one run").of(name)
    assert Tokens(b"one run").name(token) == name
    assert Tokens(b"another run").name(token) == ""


@given(st.text(st.characters(exclude_categories=()), max_size=80))
@example("616e6e61.\ud800")
@example("616e6e61.flïes")
def test_what_is_no_token_shows_nobody(text: str) -> None:
    assert Tokens(b"one run").name(text) == ""


def test_what_it_lacks_first_is_certificates_since_tokens_come_with_them() -> None:
    assert "needs TLS" in Access("192.168.1.5").trouble()


@pytest.mark.parametrize("host", ["[", "[::1", "[x]"])
def test_a_host_that_is_no_address_is_foreign(host: str) -> None:
    assert Access().foreign({"host": host})


class _Desk:
    """What a lease office needs of a desk that asks nobody."""

    tokens = Tokens(b"secret")


def test_a_console_that_was_started_again_waits_until_it_knows_who_holds_control() -> None:
    known: list[str | None] = [None, None, "anna"]

    def holder() -> str | None:
        return known.pop(0) if len(known) > 1 else known[0]

    office = LeaseOffice(_Desk(), holder)  # type: ignore[arg-type]
    assert asyncio.run(office.author("arm", _Desk.tokens.of("anna"))) == "anna"
    with pytest.raises(NotAllowedError, match="held by anna"):
        asyncio.run(office.author("arm", _Desk.tokens.of("bert")))
