# SPDX-License-Identifier: LGPL-2.1-or-later
"""For tests and benchmarks: a private PostgreSQL, empty databases, a server process, and a small caller."""

from server_testing.caller import (
    Answer,
    Api,
    Event,
    EventReader,
    another_user,
    bom,
    form_body,
    merge_body,
    run_alone,
    wait_until,
)
from server_testing.databases import Databases, empty_database, postgres, sqlite_database
from server_testing.process import ServerProcess, reserved_port

__all__ = [
    "Answer",
    "Api",
    "Databases",
    "Event",
    "EventReader",
    "ServerProcess",
    "another_user",
    "bom",
    "empty_database",
    "form_body",
    "merge_body",
    "postgres",
    "reserved_port",
    "run_alone",
    "sqlite_database",
    "wait_until",
]
