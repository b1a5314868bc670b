# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod serve``, ``backup``, ``restore`` and ``summaries``: a server of your own."""

from __future__ import annotations

import argparse
import importlib.metadata
import importlib.util
import json
import sys
from contextlib import suppress
from dataclasses import asdict

from silo import spoken
from silo.bom.errors import ConfigError, Exit
from silo.bom.message import message
from silo.cli.options import a_path, add_old_name, add_options, not_with


def add_serve(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--host", default="127.0.0.1", help="address to listen on (default: this machine only)"
    )
    parser.add_argument("--port", type=int, default=8080, help="port; 0 takes a free one (default: 8080)")
    add_options(
        parser, {"--database URL": message("sqlite:///FILE or postgresql://…; default: your data folder")}
    )
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="server processes (PostgreSQL)")
    add_options(
        parser, {"--reset-admin NAME": message("make this user an active admin, and print a login link")}
    )
    parser.set_defaults(waits=True)


def need_server_extra() -> None:
    """Raise an error in one plain sentence if the server's packages are not installed."""
    missing = [
        name for name in ("fastapi", "sqlalchemy", "alembic", "uvicorn") if not importlib.util.find_spec(name)
    ]
    if missing:
        raise ConfigError(
            message(
                "the embedded server needs {missing}; install it with: pip install 'silo-mod[server]'",
                missing=", ".join(missing),
            )
        )


def run_serve(args: argparse.Namespace) -> int:
    """Serve until stopped, which is how a server ends: returns 0 also after Ctrl-C or a TERM signal."""
    need_server_extra()
    from silo_server.run import Greeting, serve

    def tell(greeting: Greeting) -> None:
        text = json.dumps(asdict(greeting)) if args.json else spoken("\n".join(greeting.lines()))
        # A reader of a pipe waits for the address, and the server never ends by itself.
        print(text, flush=True)

    with suppress(KeyboardInterrupt):
        serve(
            args.host, args.port, args.database, workers=args.workers, reset_admin=args.reset_admin, tell=tell
        )
    return Exit.DONE


def add_backup(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("target", metavar="TARGET", type=a_path, help="a folder that is not there yet")
    _add_place(parser)


def add_restore(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("source", metavar="SOURCE", type=a_path, help="the folder of a backup")
    add_options(
        parser,
        {
            "--replace-database": message("replace a database that has items; they are lost"),
            "--dry-run": message("only check that the backup is whole; change nothing"),
            "--test": message(
                "restore into a scratch folder beside the backup, compare, and note the day at the server"
            ),
        },
    )
    _add_place(parser)
    add_old_name(parser, "--replace", "--replace-database")
    add_old_name(parser, "--verify", "--dry-run")
    not_with(parser, "--test", "--replace-database", "--dry-run")
    not_with(parser, "--dry-run", "--replace-database", "--database", "--files")


def add_summaries(parser: argparse.ArgumentParser) -> None:
    _add_place(parser)


def run_summaries(args: argparse.Namespace) -> int:
    """Sum up all assemblies and return 0; from then on the server keeps the sums itself."""
    need_server_extra()
    from silo_server.db.database import Database
    from silo_server.db.migrate import upgrade
    from silo_server.services.product.summary_keep import keep_all
    from silo_server.settings import settings_from_environment

    settings = settings_from_environment(database_url=args.database, files_dir=args.files)
    if settings.sqlite_path is not None and not settings.sqlite_path.is_file():
        raise ConfigError(
            message("summaries: there is no database {sqlite_path}", sqlite_path=settings.sqlite_path)
        )
    db = Database(settings)
    try:
        upgrade(db)
        count = keep_all(db, _report)
    finally:
        db.close()
    print(
        json.dumps({"assemblies": count})
        if args.json
        else spoken(message("{count} assemblies summed up.", count=count))
    )
    return Exit.DONE


def _add_place(parser: argparse.ArgumentParser) -> None:
    add_options(
        parser, {"--database URL": message("sqlite:///FILE or postgresql://… (else SILO_DATABASE_URL)")}
    )
    parser.add_argument(
        "--files",
        metavar="FOLDER",
        type=a_path,
        help="folder of the files (else SILO_STORAGE_ROOT_DIR)",
    )


def run_backup(args: argparse.Namespace) -> int:
    """Make a backup; returns 1 if files are missing that the server itself has lost."""
    need_server_extra()
    from silo_server.backup import back_up
    from silo_server.settings import settings_from_environment

    settings = settings_from_environment(database_url=args.database, files_dir=args.files)
    made = back_up(settings, args.target, _report)
    for checksum in made.missing_files:
        print(
            message(
                "missing: the file {checksum} is lost or damaged in the server's store", checksum=checksum
            ),
            file=sys.stderr,
        )
    text = message(
        "Backup {target}: {rows} rows, {files} files.",
        target=args.target,
        rows=sum(made.rows.values()),
        files=made.files,
    )
    print(json.dumps(asdict(made)) if args.json else spoken(text))
    return Exit.UNDONE if made.missing_files else Exit.DONE


def run_restore(args: argparse.Namespace) -> int:
    """Replace the server's state by a backup; ``--dry-run`` only checks it, ``--test`` restores it beside."""
    need_server_extra()
    from silo_server.backup import restore, try_restore, verify
    from silo_server.settings import settings_from_environment

    if args.dry_run:
        made = verify(args.source)
        text = message(
            "The backup of {made_at} is whole: {rows} rows, {files} files.",
            made_at=made.made_at,
            rows=sum(made.rows.values()),
            files=made.files,
        )
    elif args.test:
        settings = settings_from_environment(database_url=args.database, files_dir=args.files)
        made = try_restore(settings, args.source, _report)
        text = message(
            "The backup of {made_at} can be restored: {rows} rows, {files} files.",
            made_at=made.made_at,
            rows=sum(made.rows.values()),
            files=made.files,
        )
    else:
        settings = settings_from_environment(database_url=args.database, files_dir=args.files)
        made = restore(settings, args.source, replace=args.replace_database, report=_report)
        text = message(
            "Restored the backup of {made_at}: {rows} rows, {files} files.",
            made_at=made.made_at,
            rows=sum(made.rows.values()),
            files=made.files,
        )
    print(json.dumps(asdict(made)) if args.json else spoken(text))
    return Exit.DONE


def _report(text: str) -> None:
    print(text, file=sys.stderr)
