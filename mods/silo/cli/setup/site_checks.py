# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod doctor --server URL``: is a server set up so that a company's network may reach it?

* What is seen from outside is looked at from outside: the certificate, port 80, headers, the clock.
* What only the server knows, an administrator's token asks: proxy, cookies, backup, disk, secrets.
* A check that could not be made is a fault with its reason, never a success.
"""

from __future__ import annotations

import http.client
import re
import socket
import ssl
from collections.abc import Callable, Mapping
from contextlib import closing
from datetime import UTC, datetime, timedelta
from functools import partial
from typing import TYPE_CHECKING
from urllib.parse import SplitResult, urlsplit

from silo.bom.errors import ConfigError, SiloError
from silo.bom.message import Message, counted_message, message, template

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.wire import SystemState

# An address of no network (RFC 5737): who sees us come from there believes what a caller claims.
CLAIMED = "192.0.2.77"
# [s] For a connection of our own.
PATIENCE = 10.0
CERTIFICATE_DAYS = 14
CLOCK = timedelta(minutes=1)
BACKUP = timedelta(days=2)
RESTORE = timedelta(days=8)
# [bytes]
FREE = 1 << 30

_SECRETS: Mapping[str, str] = {
    "admin_password": template(
        "SILO_ADMIN_PASSWORD is still set; it is used at the first start only, so remove it from the settings"
    ),
    "database_password": template(
        "the password of the database can be guessed; set another in PostgreSQL and in SILO_DATABASE_URL"
    ),
    "readable": template("other users of the server's machine can read {path}; chmod o-rwx closes it"),
}

Findings = dict[str, "str | SiloError"]


def site(
    client: SiloClient,
    verify: bool | str,
    *,
    plain_port: int = 80,
    now: Callable[[], datetime] = lambda: datetime.now(UTC),
) -> Findings:
    """Look at each part of the installation; an error is an answer too.

    plain_port
        where the server's machine answers without TLS.
    now
        the time here.
    """
    parts = urlsplit(client.base_url)
    if parts.scheme == "http" and client.local:
        return {"network": message("only this machine reaches it; its setup for others is not checked")}
    found: Findings = {
        "TLS": _tried(lambda: _certificate(parts, verify, now())),
        "port 80": _tried(lambda: _redirect(parts, plain_port)),
        "HSTS": _tried(lambda: _strict_transport(parts, verify)),
    }
    try:
        before, state, after = now(), client.system(CLAIMED), now()
    except SiloError as error:
        reason = ConfigError(message("only an administrator's token can ask for it: {reason}", reason=error))
        return found | dict.fromkeys((*_ASKED, "clock"), reason)
    middle = before + (after - before) / 2
    found["clock"] = _tried(lambda: _clock(state, middle))
    asked: Findings = {name: _tried(partial(look, state, parts, middle)) for name, look in _ASKED.items()}
    return found | asked


def _tried(look: Callable[[], str]) -> str | SiloError:
    try:
        return look()
    except SiloError as error:
        return error
    except (OSError, http.client.HTTPException, ValueError) as error:
        return ConfigError(message("it cannot be looked at: {reason}", reason=error))


def _trust(verify: bool | str) -> ssl.SSLContext:
    return ssl.create_default_context(cafile=verify if isinstance(verify, str) else None)


def _certificate(parts: SplitResult, verify: bool | str, now: datetime) -> str:
    if parts.scheme != "https":
        raise ConfigError(
            message(
                "passwords and tokens cross the network readable: put a proxy with TLS before the server "
                "(docs/install-server.md)"
            )
        )
    if verify is False:
        raise ConfigError(
            message("this machine does not check the server's certificate; name the file of its authority")
        )
    address = (parts.hostname or "", parts.port or 443)
    try:
        with (
            socket.create_connection(address, PATIENCE) as plain,
            _trust(verify).wrap_socket(plain, server_hostname=parts.hostname) as secure,
        ):
            certificate, version = secure.getpeercert() or {}, secure.version() or ""
    except ssl.SSLError as error:
        raise ConfigError(message("the certificate is refused: {reason}", reason=error)) from error
    end = datetime.fromtimestamp(ssl.cert_time_to_seconds(str(certificate["notAfter"])), UTC)
    days = (end - now).days
    if days < CERTIFICATE_DAYS:
        raise ConfigError(
            counted_message(
                days,
                "the certificate ends in {n} day; renew it, and see why that was not done by itself",
                "the certificate ends in {n} days; renew it, and see why that was not done by itself",
            )
        )
    return message("{version}, certificate until {end}", version=version, end=f"{end:%Y-%m-%d}")


def _redirect(parts: SplitResult, port: int) -> str:
    with closing(http.client.HTTPConnection(parts.hostname or "", port, timeout=PATIENCE)) as connection:
        try:
            connection.request("GET", parts.path or "/")
            answer = connection.getresponse()
        except ConnectionRefusedError:
            raise ConfigError(
                message("nothing answers without TLS; redirect port 80, or who types the address is lost")
            ) from None
        target = urlsplit(answer.headers.get("location", ""))
    if answer.status not in (301, 302, 307, 308) or (target.scheme, target.hostname) != (
        "https",
        parts.hostname,
    ):
        raise ConfigError(
            message(
                "wanted a redirect to https, got the status {status}: pages are served readable",
                status=answer.status,
            )
        )
    return message("redirects to https")


def _strict_transport(parts: SplitResult, verify: bool | str) -> str:
    host = parts.hostname or ""
    connection: http.client.HTTPConnection = http.client.HTTPConnection(host, parts.port, timeout=PATIENCE)
    if parts.scheme == "https":
        connection = http.client.HTTPSConnection(host, parts.port, timeout=PATIENCE, context=_trust(verify))
    with closing(connection):
        connection.request("GET", f"{parts.path}/health")
        header = connection.getresponse().headers.get("strict-transport-security", "")
    seconds = re.search(r"max-age=(\d{1,12})", header, re.ASCII)
    if parts.scheme != "https" or seconds is None or int(seconds[1]) < 86_400:
        raise ConfigError(
            message("the proxy does not tell browsers to stay with https: add Strict-Transport-Security")
        )
    return counted_message(int(seconds[1]) // 86_400, "for {n} day", "for {n} days")


def _clock(state: SystemState, here: datetime) -> str:
    if abs(apart := _time(state.at) - here) > CLOCK:
        raise ConfigError(
            counted_message(
                round(apart.total_seconds()),
                "the server's clock and the one here are {n} second apart; let both follow a time server",
                "the server's clock and the one here are {n} seconds apart; let both follow a time server",
            )
        )
    return message("the same as here")


def _proxy(state: SystemState, parts: SplitResult, _: datetime) -> str:
    seen = state.request
    if seen is None:
        raise ConfigError(message("the server does not say; it is older than this program"))
    if seen.forwarded_for.strip() in ("", CLAIMED):
        raise ConfigError(
            message("the proxy does not add the caller to X-Forwarded-For, so all callers are one address")
        )
    # The server believes its own machine, so that a look from there cannot show whom else it believes; its
    # start warns of SILO_TRUSTED_PROXIES=*.
    last = seen.forwarded_for.rpartition(",")[2].strip()
    if seen.address == CLAIMED and last not in ("127.0.0.1", "::1"):
        raise ConfigError(
            message(
                "the server believes each caller's X-Forwarded-For: name only the proxy in "
                "SILO_TRUSTED_PROXIES"
            )
        )
    if seen.scheme != parts.scheme:
        raise ConfigError(
            message(
                "the server thinks that it is reached by {scheme}: let the proxy send X-Forwarded-Proto, and "
                "name the proxy in SILO_TRUSTED_PROXIES",
                scheme=seen.scheme,
            )
        )
    if (public := (state.public_url or "").rstrip("/")) != parts.geturl().rstrip("/"):
        raise ConfigError(
            message(
                "login links begin with {public}; set SILO_PUBLIC_URL to {url}",
                public=public,
                url=parts.geturl(),
            )
        )
    return message("it sees callers from {address}, by {scheme}", address=seen.address, scheme=seen.scheme)


def _cookies(state: SystemState, _: SplitResult, __: datetime) -> str:
    if not state.secure_cookies:
        raise ConfigError(message("session cookies also go over plain HTTP: set SILO_SECURE_COOKIES to yes"))
    return message("over TLS only")


def _backup(state: SystemState, _: SplitResult, now: datetime) -> str:
    saved = state.backup
    if saved is None:
        raise ConfigError(message("there is none: start silo-backup.timer, or run silo-mod backup"))
    if now - _time(saved.at) > BACKUP:
        raise ConfigError(
            message("the last is of {at}: see why silo-backup.service does not run", at=saved.at[:16])
        )
    if saved.same_disk is not False:
        raise ConfigError(
            message(
                "{target} is on the disk of the server's files: one broken disk takes both; use another",
                target=saved.target,
            )
        )
    return message("of {at}, in {target}", at=saved.at[:16], target=saved.target)


def _restore(state: SystemState, _: SplitResult, now: datetime) -> str:
    tried = state.restore_tried
    if tried is None:
        raise ConfigError(
            message(
                "no backup was ever restored: start silo-restore-test.timer, or run silo-mod restore --test"
            )
        )
    if now - _time(tried.at) > RESTORE:
        raise ConfigError(
            message("the last was on {at}: see why silo-restore-test.service does not run", at=tried.at[:16])
        )
    return message("on {at}, of the backup of {made_at}", at=tried.at[:16], made_at=tried.made_at[:16])


def _disk(state: SystemState, _: SplitResult, __: datetime) -> str:
    if state.free_bytes is None:
        raise ConfigError(message("the server cannot say how much room it has"))
    wanted = max(FREE, state.database_bytes)
    free = f"{state.free_bytes / 1e9:.1f}"
    if state.free_bytes < wanted:
        raise ConfigError(
            message(
                "{free} GB free, wanted {wanted}: an update copies what it rebuilds; make room",
                free=free,
                wanted=f"{wanted / 1e9:.1f}",
            )
        )
    return message("{free} GB free", free=free)


def _secrets(state: SystemState, _: SplitResult, __: datetime) -> str:
    if state.open_secrets is None:
        raise ConfigError(message("the server does not say; it is older than this program"))
    if state.open_secrets:
        code, _colon, path = state.open_secrets[0].partition(": ")
        raise ConfigError(Message(_SECRETS[code], {"path": path}) if code in _SECRETS else code)
    return message("none lies open")


def _start(state: SystemState, _: SplitResult, __: datetime) -> str:
    if state.warnings:
        raise ConfigError(" ".join(state.warnings))
    return message("nothing was wrong with the settings")


def _time(text: str) -> datetime:
    return datetime.fromisoformat(text)


_ASKED: Mapping[str, Callable[[SystemState, SplitResult, datetime], str]] = {
    "proxy": _proxy,
    "cookies": _cookies,
    "backup": _backup,
    "test restore": _restore,
    "disk": _disk,
    "secrets": _secrets,
    "start": _start,
}
