# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which server and which token: options, environment, file; and a private file."""

from __future__ import annotations

import logging
import os
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.api.config import config_path, load_config, resolve_server, save_config
from silo.bom.errors import ConfigError


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "deep" / "config.toml"


def test_without_a_server_the_message_says_how_to_get_one(path: Path) -> None:
    """The first thing that a new user sees."""
    with pytest.raises(ConfigError) as caught:
        resolve_server(env={}, path=path)
    for hint in ("silo-mod serve", "SILO_API_URL", "SILO_API_TOKEN", "--server", str(path)):
        assert hint in str(caught.value)


def test_options_win_over_the_environment_and_that_over_the_file(path: Path) -> None:
    """Each may be given alone; an empty variable counts as none."""
    save_config("http://file", "silo_file", path=path)
    env = {"SILO_API_URL": "http://env", "SILO_API_TOKEN": " silo_env "}
    assert resolve_server("http://option", "silo_option", env=env, path=path).url == "http://option"
    from_env = resolve_server(None, None, env=env, path=path)
    assert (from_env.url, from_env.token) == ("http://env", "silo_env")
    assert (from_env.url_from, from_env.token_from) == ("SILO_API_URL", "SILO_API_TOKEN")
    from_file = resolve_server(env={}, path=path)
    assert (from_file.url, from_file.token, from_file.token_from) == ("http://file", "silo_file", str(path))


def test_the_files_token_is_for_the_files_server_only(path: Path) -> None:
    """`--server http://elsewhere` must not hand our token to elsewhere."""
    save_config("https://silo.example.com", "silo_file", path=path)
    assert resolve_server("https://other.example.com", env={}, path=path).token is None
    assert resolve_server("https://silo.example.com:443/api", env={}, path=path).token == "silo_file"


def test_the_token_is_not_in_the_repr(path: Path) -> None:
    """Settings end up in logs."""
    assert "silo_x" not in repr(resolve_server("http://h", "silo_x", env={}, path=path))


@pytest.mark.parametrize(
    ("text", "value"), [("0", False), ("No", False), ("off", False), ("1", True), ("TRUE", True), ("", True)]
)
def test_the_check_of_certificates_is_read(path: Path, text: str, value: bool) -> None:
    """SILO_SSL_VERIFY as people write it."""
    env = {"SILO_API_URL": "https://h", "SILO_SSL_VERIFY": text}
    assert resolve_server(env=env, path=path).verify is value


def test_the_check_may_name_a_file_that_exists(path: Path, tmp_path: Path) -> None:
    """A typo must not silently turn into "no check", nor into a riddle later."""
    authorities = tmp_path / "ca.pem"
    authorities.write_text("x")
    assert resolve_server("https://h", verify=str(authorities), env={}, path=path).verify == str(authorities)
    with pytest.raises(ConfigError, match=r"ca2\.pem is not a file"):
        resolve_server("https://h", env={"SILO_SSL_VERIFY": str(tmp_path / "ca2.pem")}, path=path)
    save_config("https://h", verify=False, path=path)
    assert resolve_server(env={}, path=path).verify is False


@pytest.mark.usefixtures("needs_modes")
def test_the_file_is_private(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Mode 0600 from the first byte, in a folder of its own; an open one is warned about."""
    save_config("http://h", "silo_x", path=path)
    assert path.stat().st_mode & 0o777 == 0o600
    assert path.parent.stat().st_mode & 0o777 == 0o700
    path.chmod(0o644)
    with caplog.at_level(logging.WARNING):
        load_config(path)
    assert "chmod 600" in caplog.text
    save_config("http://h", "silo_x", path=path)
    assert path.stat().st_mode & 0o777 == 0o600


def test_a_file_with_anything_else_is_left_alone(path: Path) -> None:
    """Other settings are not ours to drop, nor to keep in silence: no command would read them."""
    path.parent.mkdir()
    text = '[server]\nurl = "http://a"\ntoken = "t"\nproxy = "p"\n[other.deep]\nn = [1, 2]\n'
    path.write_text(text)
    with pytest.raises(ConfigError, match="unknown key proxy"):
        save_config("http://b", path=path)
    assert path.read_text() == text
    assert not [p for p in path.parent.iterdir() if p != path]


def test_a_token_that_is_not_given_any_more_goes(path: Path) -> None:
    """It belongs to the server of before."""
    save_config("http://a", "silo_x", path=path)
    save_config("http://b", path=path)
    assert load_config(path) == {"server": {"url": "http://b", "verify": True}}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[server\n", "cannot be read"),
        ("\udcff", "cannot be read"),
        ("server = 5", "wanted a table [server]"),
        ("[server]\nurl = 5", "server.url wants a text"),
        ("[server.url]\nx = 1\n", "server.url wants a text"),
        ("[server]\nurl = 'http://h'\ntoken = true", "server.token wants a text"),
        ('# mine\nurl = "http://h"\n', "line 2: unknown key url; it belongs below [server]"),
        ('\n[Server]\nurl = "http://h"\n', "line 2: unknown table [Server]; did you mean [server]?"),
        ('[server]\ntokn = "t"\n', "line 2: unknown key tokn in [server]; did you mean token?"),
        ("[server]\n\nproxy = 1\n", "line 3: unknown key proxy in [server] (known: url, token"),
    ],
)
def test_a_file_that_cannot_be_understood_is_an_error(path: Path, text: str, told: str) -> None:
    """Which file, which line, what is wrong: a misspelt token must not look like no token."""
    path.parent.mkdir()
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    path.chmod(0o600)
    with pytest.raises(ConfigError, match=re.escape(told)) as caught:
        resolve_server(env={}, path=path)
    assert str(path) in str(caught.value)


def test_nonsense_is_not_saved(path: Path) -> None:
    """An address is checked before it is written."""
    with pytest.raises(ConfigError):
        save_config("not an address", path=path)
    assert not path.exists()


def test_the_path_follows_the_platform(tmp_path: Path) -> None:
    """XDG_CONFIG_HOME where it is set."""
    if os.name == "posix" and os.uname().sysname == "Linux":
        env = {"XDG_CONFIG_HOME": str(tmp_path)}
        assert config_path(env) == tmp_path / "silo-mod" / "config.toml"
        assert config_path({"HOME": "/home/designer"}) == Path("/home/designer/.config/silo-mod/config.toml")


texts = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=20)


@given(texts, st.one_of(st.booleans(), texts))
def test_what_is_saved_is_read_again(tmp_path: Path, token: str, verify: bool | str) -> None:
    """Whatever the texts hold."""
    path = save_config("http://h", token, verify, path=tmp_path / "config.toml")
    assert load_config(path) == {"server": {"url": "http://h", "token": token, "verify": verify}}
