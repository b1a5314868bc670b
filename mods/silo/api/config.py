# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which server, which token: options first, then the environment, then the user's configuration file.

The file is TOML, readable by its owner only::

    [server]
    url = "https://silo.example.com"
    token = "silo_…"
    verify = true            # or false, or the path of a file with certificate authorities
"""

from __future__ import annotations

import json
import logging
import os
import re
import stat
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from silo.api.address import ServerAddress, same_server
from silo.bom.errors import ConfigError, did_you_mean
from silo.bom.message import joined, message
from silo.bom.numbers import yes_or_no
from silo.bom.system_refusals import why_refused
from silo.platform.system import MODES_COUNT
from silo.platform.user_folders import config_folder
from silo.platform.whole_files import replacing

log = logging.getLogger("silo.api")

Source = TypeVar("Source", bound=str)

URL, TOKEN, VERIFY = "SILO_API_URL", "SILO_API_TOKEN", "SILO_SSL_VERIFY"

_KEYS = ("url", "token", "verify")
_HOW = message(
    "Start one on this computer with `silo-mod serve` (it prints its address and a token), "
    "then run `silo-mod login http://127.0.0.1:8080`, set {url} and {token}, or give "
    "--server and --token",
    url=URL,
    token=TOKEN,
)


@dataclass(frozen=True)
class ServerSettings:
    """Where the server is. ``url_from`` and ``token_from`` say who said so, for people."""

    url: str
    token: str | None = field(default=None, repr=False)
    verify: bool | str = True
    url_from: str = ""
    token_from: str = ""


def config_path(env: Mapping[str, str] = os.environ) -> Path:
    """Return the configuration file, whether it exists or not."""
    return config_folder(env) / "config.toml"


def resolve_server(
    server: str | None = None,
    token: str | None = None,
    verify: bool | str | None = None,
    *,
    env: Mapping[str, str] = os.environ,
    path: Path | None = None,
) -> ServerSettings:
    """Find server and token; raises :class:`ConfigError` that says how to get one if there is none.

    A token in the file belongs to the server in the file: it is not sent to another server that an option or
    the environment names.
    """
    path = path or config_path(env)
    for option, given in (("--server", server), ("--token", token)):
        if given is not None and not given.strip():
            raise ConfigError(
                message(
                    "{option} is empty; leave it out, or give a value (a variable may be unset)",
                    option=option,
                )
            )
    stored = checked_config(path).get("server", {})
    file_url, file_token = _text(stored, "url", path), _text(stored, "token", path)
    url, url_from = first_of(("--server", server), (URL, env.get(URL)), (str(path), file_url))
    if url is None:
        raise ConfigError(
            message("no Silo server is configured. {how}, or write both into {path}", how=_HOW, path=path)
        )
    if not same_server(url, file_url):
        file_token = None
    server_url, token_from = first_of(("--token", token), (TOKEN, env.get(TOKEN)), (str(path), file_token))
    return ServerSettings(
        url=url,
        token=server_url,
        verify=_verify(verify, env.get(VERIFY), stored.get("verify"), path),
        url_from=url_from or "",
        token_from=token_from or "",
    )


def load_config(path: Path) -> dict[str, Any]:
    """Read the whole file as TOML tables; {} if there is no file."""
    try:
        with path.open("rb") as file:
            if MODES_COUNT and os.fstat(file.fileno()).st_mode & (stat.S_IRWXG | stat.S_IRWXO):
                log.warning("%s can be read by others and may hold a token; chmod 600 keeps it private", path)
            return tomllib.load(file)
    except FileNotFoundError:
        return {}
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(
            message(
                "{path}: the configuration cannot be read ({error}); repair or remove it",
                path=path,
                error=why_refused(error),
            )
        ) from error


def save_config(
    url: str,
    token: str | None = None,
    verify: bool | str = True,
    *,
    path: Path | None = None,
    env: Mapping[str, str] = os.environ,
) -> Path:
    """Save server and token in the file (mode 0600), and return its path.

    Raises :class:`ConfigError` for a file that holds anything else, which stays as it is.
    """
    ServerAddress.parse(url)
    path = path or config_path(env)
    checked_config(path)
    values = {"url": url, "verify": verify, **({"token": token} if token else {})}
    # JSON's texts are TOML's; DEL is the one character that only TOML wants escaped.
    lines = [f"{name} = {json.dumps(value, ensure_ascii=False)}" for name, value in values.items()]
    text = "\n".join(["[server]", *lines, ""]).replace("\x7f", "\\u007f")
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        # Only its owner can read the new file before a byte of the token is in it.
        with replacing(path) as file:
            file.write(text.encode())
    except OSError as error:
        raise ConfigError(
            message(
                "{path}: the configuration cannot be written ({error})",
                path=path,
                error=why_refused(error),
            )
        ) from error
    return path


def checked_config(path: Path) -> dict[str, Any]:
    """Read the file's tables. ConfigError lists, with their lines, all keys and tables that we do not
    know.
    """
    config = load_config(path)
    problems = []
    for name, value in config.items():
        if name != "server":
            inside = (
                message("; it belongs below [server]") if name in _KEYS else _hint(f"[{name}]", ("[server]",))
            )
            what = (
                message("unknown table [{name}]", name=name)
                if isinstance(value, dict)
                else message("unknown key {name}", name=name)
            )
            problems.append(
                message("line {name}: {what}{inside}", name=_line(path, name), what=what, inside=inside)
            )
        elif not isinstance(value, dict):
            problems.append(
                message(
                    "line {name}: wanted a table [server], got {value}",
                    name=_line(path, name),
                    value=repr(value),
                )
            )
        else:
            problems += [
                message(
                    "line {line}: unknown key {key} in [server]{hint}",
                    line=_line(path, key),
                    key=key,
                    hint=_hint(key, _KEYS),
                )
                for key in value
                if key not in _KEYS
            ]
    if problems:
        raise ConfigError(
            message("{path}: {problems}. Mend or remove it", path=path, problems=joined("; ", problems))
        )
    return config


def _hint(name: str, names: Sequence[str]) -> str:
    return did_you_mean(name.lower(), names) or message(" (known: {names})", names=", ".join(names))


def _line(path: Path, name: str) -> int:
    """Return the line that first names a key or a table; TOML's reader does not tell it."""
    begins = re.compile(rf"""\s*\[*\s*["']?{re.escape(name)}["']?\s*[.=\]]""")
    lines = path.read_text(encoding="utf-8").splitlines()
    return next((number for number, line in enumerate(lines, start=1) if begins.match(line)), 1)


def _text(table: Mapping[str, Any], key: str, path: Path) -> str | None:
    value = table.get(key)
    if value is not None and not isinstance(value, str):
        raise ConfigError(
            message(
                "{path}: server.{key} wants a text in quotes, got {name}",
                path=path,
                key=key,
                name=type(value).__name__,
            )
        )
    return value


def first_of(
    *candidates: tuple[Source, str | Callable[[], str | None] | None],
) -> tuple[str | None, Source | None]:
    """Return the first setting that is not empty, and its source. Calls a callable only if nothing before it
    is set.
    """
    for source, value in candidates:
        setting = value() if callable(value) else value
        if setting is not None and setting.strip():
            return setting.strip(), source
    return None, None


def _verify(option: bool | str | None, variable: str | None, stored: Any, path: Path) -> bool | str:
    for source, value in (
        ("verify", option),
        (VERIFY, variable),
        (message("server.verify in {path}", path=path), stored),
    ):
        if isinstance(value, bool):
            return value
        if isinstance(value, str) and value.strip():
            return verify_of(source, value.strip())
    return True


def verify_of(source: str, text: str) -> bool | str:
    """Return how to check certificates: yes, no, or the path of a file. ConfigError names ``source``."""
    if (checked := yes_or_no(text)) is not None:
        return checked
    if not Path(text).expanduser().exists():
        raise ConfigError(
            message(
                "{source}: wanted true, false or a file with certificate authorities; {text} is not a file",
                source=source,
                text=text,
            )
        )
    return str(Path(text).expanduser())
