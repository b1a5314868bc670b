# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod serve``, ``backup``, ``restore``: a server of your own. ``watch``: what happens on a server."""

from __future__ import annotations

import argparse
import importlib.util
import json
import queue
import sys
from contextlib import suppress
from dataclasses import asdict
from typing import TYPE_CHECKING

from silo.activity import activity_text
from silo.bom.errors import AuthError, ConfigError, Exit, NotFoundError, RouteMissingError
from silo.cli import common
from silo.cli.common import Commands

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.events import ConnectionState
    from silo.api.sse import ServerEvent


def register(commands: Commands) -> None:
    """Add the commands."""
    _add_serve(commands)
    _add_backup(commands)
    _add_watch(commands)


def _add_serve(commands: Commands) -> None:
    parser = common.add_command(
        commands,
        "serve",
        "run a Silo server here, on SQLite or PostgreSQL; prints its address and a token",
        "silo-mod serve --port 8080 --database postgresql://silo@localhost/silo",
    )
    parser.add_argument(
        "--host", default="127.0.0.1", help="address to listen on (default: this machine only)"
    )
    parser.add_argument("--port", type=int, default=8080, help="port; 0 takes a free one (default: 8080)")
    parser.add_argument(
        "--database", metavar="URL", help="sqlite:///FILE or postgresql://…; default: your data folder"
    )
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="server processes (PostgreSQL)")
    parser.add_argument(
        "--reset-admin", metavar="NAME", help="make this user an active admin, and print a login link"
    )
    common.add_json_option(parser)
    parser.set_defaults(run=run_serve)


def need_server_extra() -> None:
    """One plain sentence where the server's packages are not installed."""
    missing = [
        name for name in ("fastapi", "sqlalchemy", "alembic", "uvicorn") if not importlib.util.find_spec(name)
    ]
    if missing:
        raise ConfigError(
            f"the embedded server needs {', '.join(missing)}; install it with: pip install 'silo-mod[server]'"
        )


def run_serve(args: argparse.Namespace) -> int:
    """Serve until stopped, which is how a server ends: 0 also after Ctrl-C or a TERM signal."""
    need_server_extra()
    from silo_server.run import Greeting, serve

    def tell(greeting: Greeting) -> None:
        text = json.dumps(asdict(greeting)) if args.json else "\n".join(greeting.lines())
        # Whoever reads the output of a pipe waits for the address, and the server never ends by itself.
        print(text, flush=True)

    with suppress(KeyboardInterrupt):
        serve(
            args.host, args.port, args.database, workers=args.workers, reset_admin=args.reset_admin, tell=tell
        )
    return Exit.DONE


def _add_backup(commands: Commands) -> None:
    backup = common.add_command(
        commands,
        "backup",
        "save a server's database and files to a new folder, while it serves",
        "silo-mod backup /backups/silo-2026-02-08 --database postgresql://silo@localhost/silo",
    )
    backup.add_argument("target", metavar="TARGET", type=common.a_path, help="a folder that is not there yet")
    _add_place(backup)
    backup.set_defaults(run=run_backup)
    restore = common.add_command(
        commands,
        "restore",
        "bring a server's database and files back from a backup, to SQLite or PostgreSQL",
        "silo-mod restore /backups/silo-2026-02-08 --database sqlite:///silo.db",
    )
    restore.add_argument("source", metavar="SOURCE", type=common.a_path, help="the folder of a backup")
    restore.add_argument(
        "--replace", action="store_true", help="replace a database that has items; they are lost"
    )
    restore.add_argument(
        "--verify", action="store_true", help="only check that the backup is whole; change nothing"
    )
    _add_place(restore)
    common.not_with(restore, "--verify", "--replace", "--database", "--files")
    restore.set_defaults(run=run_restore)


def _add_place(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--database", metavar="URL", help="sqlite:///FILE or postgresql://… (else SILO_DATABASE_URL)"
    )
    parser.add_argument(
        "--files",
        metavar="FOLDER",
        type=common.a_path,
        help="folder of the files (else SILO_STORAGE_ROOT_DIR)",
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
    return Exit.UNDONE if made.missing_files else Exit.DONE


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
    return Exit.DONE


def _report(text: str) -> None:
    print(text, file=sys.stderr)


# Windows takes Ctrl-C between two waits, never within one.
_CTRL_C_S = 0.5


def _add_watch(commands: Commands) -> None:
    parser = common.add_command(
        commands,
        "watch",
        "show the server's events as they happen (Ctrl-C ends)",
        "silo-mod watch --item A01-0001",
    )
    parser.add_argument("--item", metavar="PART_NUMBER", help="only events of this item")
    parser.add_argument("--count", type=common.above_zero, metavar="N", help="end after N events")
    common.add_json_option(parser)
    common.add_server_options(parser)
    parser.set_defaults(run=run_watch, ends_with_its_reader=True)


def run_watch(args: argparse.Namespace) -> int:
    """Print events until stopped; the connection is made anew whenever it is lost."""
    from silo.api.events import EventListener

    events: queue.Queue[ServerEvent | ConnectionState] = queue.Queue()
    with common.client_of(args) as client:
        with suppress(NotFoundError):  # a server that does not say who we are has answered all the same
            client.whoami()  # a wrong address or token is reported at once, not retried
        if args.item:
            args.item = common.named_item(client, args.item).part_number
        mode = client.ready().mode
        print(f"[{client.base_url}: {mode}]", file=sys.stderr)
        listener = EventListener(client, on_event=events.put, on_state=events.put)
        listener.start()
        try:
            return _print_events(args, client, events)
        finally:
            listener.stop()


def _print_events(
    args: argparse.Namespace, client: SiloClient, events: queue.Queue[ServerEvent | ConnectionState]
) -> int:
    from silo.api.events import Connection, ConnectionState

    shown = 0
    while args.count is None or shown < args.count:
        try:
            event = events.get(timeout=_CTRL_C_S)
        except queue.Empty:
            continue
        if isinstance(event, ConnectionState):
            if event.kind is Connection.UNSUPPORTED:
                raise RouteMissingError(f"there is no live connection: {event.message}")
            if event.kind is Connection.REFUSED:
                raise AuthError(f"the live connection ended: {event.message}")
            print(f"[{event}]", file=sys.stderr)
            continue
        if event.type == "heartbeat" or (args.item and event.item != args.item):
            continue
        shown += 1
        if args.json:
            print(
                common.json_text(
                    {
                        "id": event.id,
                        "type": event.type,
                        "event": event.name or event.type,
                        "data": event.data,
                    }
                ),
                flush=True,
            )
        else:
            _show_event(client, event)
    return Exit.DONE


def _show_event(client: SiloClient, event: ServerEvent) -> None:
    from silo.cli import show

    out = show.console()
    if event.merge is not None:
        url = client.web_url(event.merge.resolve_url) if event.merge.resolve_url else ""
        out.print(show.activity_box(activity_text(event.merge.item, event.merge, resolve_url=url)))
        return
    out.print(show.plain(f"{event.type}  {event.item or ''}"), markup=False)
