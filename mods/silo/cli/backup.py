# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod backup`` and ``silo-mod restore``: the embedded server's database and files."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

from silo.cli import common
from silo.cli.common import Commands
from silo.cli.serve import need_server_extra


def register(commands: Commands) -> None:
    """Add both commands."""
    backup = common.add_command(
        commands,
        "backup",
        "save a server's database and files to a new folder, while it serves",
        "silo-mod backup /backups/silo-2026-02-08 --database postgresql://silo@localhost/silo",
    )
    backup.add_argument("target", metavar="TARGET", type=Path, help="a folder that does not exist yet")
    _add_place(backup)
    backup.set_defaults(run=run_backup)
    restore = common.add_command(
        commands,
        "restore",
        "bring a server's database and files back from a backup, to SQLite or PostgreSQL",
        "silo-mod restore /backups/silo-2026-02-08 --database sqlite:///silo.db",
    )
    restore.add_argument("source", metavar="SOURCE", type=Path, help="the folder of a backup")
    restore.add_argument(
        "--replace", action="store_true", help="replace a database that has items; they are lost"
    )
    restore.add_argument(
        "--verify", action="store_true", help="only check that the backup is whole; change nothing"
    )
    _add_place(restore)
    restore.set_defaults(run=run_restore)


def _add_place(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--database", metavar="URL", help="sqlite:///FILE or postgresql://… (else SILO_DATABASE_URL)"
    )
    parser.add_argument(
        "--files", metavar="FOLDER", type=Path, help="the folder of files (else SILO_STORAGE_ROOT_DIR)"
    )
    common.add_json_option(parser)


def run_backup(args: argparse.Namespace) -> int:
    """0; 1 where files are missing that the server itself has lost."""
    need_server_extra()
    from silo_server.operation.backup import back_up
    from silo_server.settings import settings_from_environment

    settings = settings_from_environment(database_url=args.database, files_dir=args.files)
    made = back_up(settings, args.target, _report)
    for checksum in made.missing_files:
        print(f"missing: the file {checksum} is lost or damaged in the server's store", file=sys.stderr)
    text = f"Backup {args.target}: {sum(made.rows.values())} rows, {made.files} files."
    print(json.dumps(asdict(made)) if args.json else text)
    return 1 if made.missing_files else 0


def run_restore(args: argparse.Namespace) -> int:
    """0 where the backup was whole and is now the server's state."""
    need_server_extra()
    from silo_server.operation.backup import restore, verify
    from silo_server.settings import settings_from_environment

    if args.verify:
        made = verify(args.source)
        text = f"The backup of {made.made_at} is whole: {sum(made.rows.values())} rows, {made.files} files."
    else:
        settings = settings_from_environment(database_url=args.database, files_dir=args.files)
        made = restore(settings, args.source, replace=args.replace, report=_report)
        text = f"Restored the backup of {made.made_at}: {sum(made.rows.values())} rows, {made.files} files."
    print(json.dumps(asdict(made)) if args.json else text)
    return 0


def _report(text: str) -> None:
    print(text, file=sys.stderr)
