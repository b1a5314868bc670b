# SPDX-License-Identifier: LGPL-2.1-or-later
"""The base URL rule, and which server is the same."""

from __future__ import annotations

import pytest

from silo.api.address import ServerAddress, Word, may_carry_token, origin_of
from silo.bom.errors import ConfigError, InputError


@pytest.mark.parametrize(
    ("written", "api", "web"),
    [
        ("https://silo.example.com", "https://silo.example.com/api", "https://silo.example.com"),
        ("https://silo.example.com/", "https://silo.example.com/api", "https://silo.example.com"),
        (" http://127.0.0.1:7480 ", "http://127.0.0.1:7480/api", "http://127.0.0.1:7480"),
        ("https://silo.example.com/api", "https://silo.example.com/api", "https://silo.example.com"),
        ("https://silo.example.com/api/", "https://silo.example.com/api", "https://silo.example.com"),
        ("https://host/silo/api", "https://host/silo/api", "https://host/silo"),
        ("https://host/plm", "https://host/plm", "https://host/plm"),
        ("127.0.0.1:8080", "http://127.0.0.1:8080/api", "http://127.0.0.1:8080"),
        ("localhost:8080/silo", "http://localhost:8080/silo", "http://localhost:8080/silo"),
        ("[::1]:8000", "http://[::1]:8000/api", "http://[::1]:8000"),
        ("http://[::1]:80", "http://[::1]/api", "http://[::1]"),
        ("http://[::1]:443", "http://[::1]:443/api", "http://[::1]:443"),
        ("http://[0:0:0:0:0:0:0:1]:8000", "http://[::1]:8000/api", "http://[::1]:8000"),
        ("http://[2001:DB8:0::00A]", "http://[2001:db8::a]/api", "http://[2001:db8::a]"),
        # What waits for a server is found by its address: each spelling is the same one.
        ("HTTPS://Silo.Example.COM:443/", "https://silo.example.com/api", "https://silo.example.com"),
        (" https://silo.example.com.// ", "https://silo.example.com/api", "https://silo.example.com"),
        ("http://a:8080/Silo//api/", "http://a:8080/Silo/api", "http://a:8080/Silo"),
    ],
)
def test_api_is_appended_only_where_the_address_has_no_path(written: str, api: str, web: str) -> None:
    """The rule of the older workbench (silo-contract §0.1)."""
    address = ServerAddress.parse(written)
    assert (address.api_root, address.web_root) == (api, web)


@pytest.mark.parametrize(
    "written",
    [
        "",
        "silo.example.com",
        "127.0.0.1x:8080",
        "localhost.example.com:8080",
        "ftp://host",
        "http://",
        "http://host:99999",
        "http://host?x=1",
        "http://ho st",
        "//x",
    ],
)
def test_an_address_that_is_none_says_how_to_write_one(written: str) -> None:
    """Plain words and an example."""
    with pytest.raises(ConfigError, match=r"https://silo\.example\.com"):
        ServerAddress.parse(written)


def test_a_password_in_an_address_is_refused_and_not_shown() -> None:
    """It would end up in logs."""
    with pytest.raises(ConfigError) as caught:
        ServerAddress.parse("https://designer:hunter2@silo.example.com")
    assert "hunter2" not in str(caught.value)


def test_a_part_number_is_one_segment_whatever_it_holds() -> None:
    """Slashes and blanks are quoted; dots alone, and words of the API, are escaped."""
    address = ServerAddress.parse("http://h")
    assert address.api("items", "A/1 ä?#", "bom") == "http://h/api/items/A%2F1%20%C3%A4%3F%23/bom"
    assert address.api("items", "..") == "http://h/api/items/~2E~2E"
    assert address.api("items", "search") == "http://h/api/items/~_search"
    assert address.api("items", Word("search")) == "http://h/api/items/search"
    for odd in ("", " "):
        with pytest.raises(InputError):
            address.api("items", odd)


def test_pages_of_other_servers_are_not_given() -> None:
    """Only the configured server's pages are opened."""
    address = ServerAddress.parse("https://silo.example.com/api")
    assert address.web("/items/A/bom") == "https://silo.example.com/items/A/bom"
    assert address.web("https://silo.example.com/items/A") == "https://silo.example.com/items/A"
    for foreign in ("https://evil.example/items", "//evil.example/x", "http://silo.example.com/x"):
        with pytest.raises(InputError, match=r"not on silo\.example\.com"):
            address.web(foreign)


@pytest.mark.parametrize(
    ("sender", "receiver", "allowed"),
    [
        ("https://a", "https://a:443/x", True),
        ("http://a", "https://a", True),
        ("http://a:8000", "https://a", False),
        ("https://a", "http://a", False),
        ("https://a", "https://a:8443", False),
        ("https://a", "https://b", False),
        ("http://A.example", "http://a.EXAMPLE", True),
    ],
)
def test_the_token_stays_with_its_server(sender: str, receiver: str, allowed: bool) -> None:
    """Same scheme, host and port; or the server's own upgrade to https."""
    assert may_carry_token(origin_of(sender), origin_of(receiver)) is allowed


@pytest.mark.parametrize(
    ("host", "here"), [("127.0.0.1", True), ("localhost", True), ("[::1]", True), ("a", False)]
)
def test_this_computer_is_recognised(host: str, here: bool) -> None:
    """No proxy is asked for loopback."""
    assert ServerAddress.parse(f"http://{host}").is_loopback is here
