# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a server needs to know before it starts; one frozen value, passed in, never read from a global."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from silo.bom.errors import (
    ConfigError,
)
from silo.bom.find_numbers import MOST_STEP, STEP
from silo.bom.numbers import yes_or_no
from silo.file_kind import ATTACHMENT_KINDS
from silo.platform.user_folders import data_folder

MIB = 1024 * 1024


def default_database_url() -> str:
    """Return the address of the SQLite database in the user's data folder."""
    return f"sqlite:///{data_folder() / 'silo.db'}"


@dataclass(frozen=True, kw_only=True)
class Settings:
    """The server's settings. Sizes in bytes, times in seconds.

    database_url
        ``sqlite:///path`` or ``postgresql://user:password@host/database``.
    files_dir
        where uploads are kept by hash; if not given, beside an SQLite database.
    poll_seconds
        how often the event log is looked at without a notice of news: the safety net for a lost
        notification, and how SQLite's changes by another process are seen.
    public_url
        how users reach the server (``https://silo.example.com``), for links that are sent on. If it is
        not given: the address that the server listens on.
    max_body_bytes, max_bodies_bytes
        of one request that is no upload, and of all that are held in memory at a time; one user may hold
        half of it.
    request_head_seconds, request_body_seconds
        how long a client may take to send a request; a body gets a second more for each 8 KiB of it.
    request_log
        write a line of JSON for each request to standard error.
    freecad_version
        the FreeCAD that the team works with, such as "1.0"; the add-on compares its own with it.
    root_path
        the sub-path at which a proxy shows the server (``/silo``); links and redirects begin with it.
    trusted_proxies
        addresses and networks whose ``X-Forwarded-For`` and ``X-Forwarded-Proto`` are believed.
    event_log_size, event_log_bytes
        events kept for replay; a client that was away longer gets ``reset``.
    sync_days, sync_bytes
        for how many days, and up to how many bytes, answers are kept for repeated requests.
    warnings
        what was wrong with the settings at the start, for the page of the system; not from the environment.
    openapi_login
        show the OpenAPI document to users who are logged in only.
    release_labels
        names of the revisions of products: ``letters`` (A, B, … without I and O) or ``numbers`` (1.0, 2.0).
    release_wants
        kinds of attachments that each part of one's own needs for a release, with commas: ``drawing, step``.
    release_approvals, release_override
        how many people approve a revision, and whether they may release what is blocked, with a reason.
    find_number_step
        the distance of the numbers that the lines of a BOM get: 10 for 10, 20, 30.
    history_days, audit_days
        older changes of BOMs are folded into one, older lines of the audit list deleted; 0 keeps all.
    """

    database_url: str
    files_dir: Path | None = None
    warnings: tuple[str, ...] = ()
    read_only: bool = False
    heartbeat_seconds: float = 30.0
    poll_seconds: float = 1.0
    event_log_size: int = 100_000
    event_log_bytes: int = 256 * MIB
    sync_days: float = 90.0
    sync_bytes: int = 256 * MIB
    history_days: float = 0.0
    audit_days: float = 0.0
    housekeeping_seconds: float = 600.0
    max_body_bytes: int = 16 * MIB
    max_bodies_bytes: int = 128 * MIB
    max_file_bytes: int = 512 * MIB
    max_merge_entries: int = 20_000
    max_expanded_rows: int = 200_000
    request_head_seconds: float = 20.0
    request_body_seconds: float = 60.0
    session_seconds: float = 24 * 3600.0
    login_link_seconds: float = 3600.0
    openapi_login: bool = False
    login_failures: int = 5
    login_window_seconds: float = 300.0
    secure_cookies: bool = False
    request_log: bool = False
    freecad_version: str = ""
    root_path: str = ""
    trusted_proxies: str = "127.0.0.1,::1"
    public_url: str | None = None
    release_labels: str = "letters"
    release_approvals: int = 1
    release_override: bool = True
    release_wants: str = ""
    find_number_step: int = STEP
    admin_username: str = "admin"
    admin_password: str | None = None

    def __post_init__(self) -> None:
        if self.freecad_version and not re.fullmatch(r"\d{1,3}\.\d{1,3}", self.freecad_version, re.ASCII):
            raise ConfigError(
                f"FreeCAD version: wanted two numbers such as 1.0, got {self.freecad_version!r}"
            )
        path = self.root_path
        if path and (not re.fullmatch(r"(/[\w.~-]+)+", path, re.ASCII)):
            raise ConfigError(f"root path: wanted a path such as /silo, without / at its end, got {path!r}")
        if self.release_labels not in ("letters", "numbers"):
            raise ConfigError(f"release labels: wanted letters or numbers, got {self.release_labels!r}")
        if self.release_approvals < 1:
            raise ConfigError(f"release approvals: wanted 1 or more, got {self.release_approvals}")
        if not 1 <= self.find_number_step <= MOST_STEP:
            raise ConfigError(
                f"find number step: wanted 1 to {MOST_STEP}, such as 10 for 10, 20, 30, "
                f"got {self.find_number_step}"
            )
        if unknown := [kind for kind in self.release_kinds if kind not in ATTACHMENT_KINDS]:
            raise ConfigError(
                f"release wants: wanted kinds ({', '.join(ATTACHMENT_KINDS)}), got {', '.join(unknown)}"
            )

    @property
    def release_kinds(self) -> tuple[str, ...]:
        """Return the kinds of ``release_wants``."""
        return tuple(filter(None, (kind.strip().lower() for kind in self.release_wants.split(","))))

    @property
    def sqlalchemy_url(self) -> str:
        """Return the URL with the driver that we ship. Raises ConfigError for any other kind of database."""
        for short in ("postgresql://", "postgres://"):
            if self.database_url.startswith(short):
                return "postgresql+psycopg://" + self.database_url[len(short) :]
        if not self.database_url.startswith(("sqlite://", "postgresql+psycopg://")):
            kind = self.database_url.partition("://")[0][:40]  # what follows may hold a password
            raise ConfigError(
                "database: wanted sqlite:///path/to/file.db or postgresql://user:password@host/database, "
                f"got {kind!r}"
            )
        return self.database_url

    @property
    def is_sqlite(self) -> bool:
        return self.sqlalchemy_url.startswith("sqlite")

    @property
    def sqlite_path(self) -> Path | None:
        """Return the path of the SQLite file, None for PostgreSQL; ConfigError for a database in memory."""
        if not self.is_sqlite:
            return None
        name = self.database_url.partition(":///")[2].partition("?")[0]
        if not name or name == ":memory:":
            raise ConfigError(
                f"database: wanted sqlite:///path/to/file.db, got {self.database_url!r}; "
                "a database in memory is not shared between the server's threads"
            )
        return Path(name)

    @property
    def storage(self) -> Path:
        """Return the folder where uploaded files are kept."""
        if self.files_dir is not None:
            return self.files_dir
        path = self.sqlite_path
        return path.with_name(path.stem + "-files") if path else data_folder() / "files"


_NAMES = (
    *("database_url", "read_only", "heartbeat_seconds", "event_log_size", "event_log_bytes", "sync_days"),
    *("sync_bytes", "history_days", "audit_days", "housekeeping_seconds", "max_body_bytes", "max_file_bytes"),
    *(
        "max_bodies_bytes",
        "max_merge_entries",
        "secure_cookies",
        "request_log",
        "root_path",
        "trusted_proxies",
        "public_url",
    ),
    *("admin_username", "admin_password", "freecad_version", "release_labels", "release_approvals"),
    *("release_override", "release_wants", "find_number_step", "openapi_login"),
)
_ENVIRONMENT = {name: f"SILO_{name.upper()}" for name in _NAMES} | {"files_dir": "SILO_STORAGE_ROOT_DIR"}


def settings_from_environment(environ: Mapping[str, str] | None = None, **given: Any) -> Settings:
    """Read the settings from ``SILO_…`` variables (docs/server-settings.md); ``given`` wins over them."""
    environ = os.environ if environ is None else environ
    values: dict[str, Any] = {"database_url": default_database_url()}
    kinds = {f.name: str(f.type) for f in fields(Settings)}
    for name, variable in _ENVIRONMENT.items():
        if environ.get(variable):
            values[name] = _convert(variable, environ[variable], kinds[name])
    values.update({key: value for key, value in given.items() if value is not None})
    return replace(Settings(database_url=values.pop("database_url")), **values)


def _convert(variable: str, text: str, kind: str) -> Any:
    readers: Mapping[str, Callable[[str], Any]] = {"bool": yes_or_no, "int": int, "float": float}
    if kind not in readers:
        return Path(text) if "Path" in kind else text
    value = None
    with suppress(ValueError):
        value = readers[kind](text)
    if value is None:
        raise ConfigError(f"{variable}: wanted a value of the type {kind}, got {text!r}")
    return value
