# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod login``, ``doctor`` and ``install-addon``: what the other commands need, and what is wrong.

``silo-mod serve``, ``backup``, ``restore``, ``summaries``: a server of your own.
``watch``: what happens on a server.
"""

from __future__ import annotations

import argparse
import getpass
import importlib.metadata
import importlib.util
import json
import os
import queue
import sys
import time
import webbrowser
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from silo import spoken
from silo.bom.errors import (
    AuthError,
    ConfigError,
    Exit,
    ForbiddenError,
    InputError,
    NotFoundError,
    RouteMissingError,
    SiloError,
    exit_of,
)
from silo.bom_sync import activity_text
from silo.cli.common import (
    a_path,
    above_zero,
    account_of,
    add_options,
    client_of,
    json_text,
    named_item,
    not_with,
    print_json,
)

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.events import ConnectionState
    from silo.api.sse import ServerEvent
    from silo.freecads import Installation


def add_serve(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--host", default="127.0.0.1", help="address to listen on (default: this machine only)"
    )
    parser.add_argument("--port", type=int, default=8080, help="port; 0 takes a free one (default: 8080)")
    add_options(parser, {"--database URL": "sqlite:///FILE or postgresql://…; default: your data folder"})
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="server processes (PostgreSQL)")
    add_options(parser, {"--reset-admin NAME": "make this user an active admin, and print a login link"})
    parser.set_defaults(waits=True)


def need_server_extra() -> None:
    """Raise an error in one plain sentence if the server's packages are not installed."""
    missing = [
        name for name in ("fastapi", "sqlalchemy", "alembic", "uvicorn") if not importlib.util.find_spec(name)
    ]
    if missing:
        raise ConfigError(
            f"the embedded server needs {', '.join(missing)}; install it with: pip install 'silo-mod[server]'"
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
            "--replace": "replace a database that has items; they are lost",
            "--verify": "only check that the backup is whole; change nothing",
        },
    )
    _add_place(parser)
    not_with(parser, "--verify", "--replace", "--database", "--files")


def add_summaries(parser: argparse.ArgumentParser) -> None:
    _add_place(parser)


def run_summaries(args: argparse.Namespace) -> int:
    """Sum up all assemblies and return 0; from then on the server keeps the sums itself."""
    need_server_extra()
    from silo_server.db.database import Database
    from silo_server.db.migrate import upgrade
    from silo_server.services.bom.summary import keep_all
    from silo_server.settings import settings_from_environment

    settings = settings_from_environment(database_url=args.database, files_dir=args.files)
    if settings.sqlite_path is not None and not settings.sqlite_path.is_file():
        raise ConfigError(f"summaries: there is no database {settings.sqlite_path}")
    db = Database(settings)
    try:
        upgrade(db)
        count = keep_all(db, _report)
    finally:
        db.close()
    print(json.dumps({"assemblies": count}) if args.json else spoken(f"{count} assemblies summed up."))
    return Exit.DONE


def _add_place(parser: argparse.ArgumentParser) -> None:
    add_options(parser, {"--database URL": "sqlite:///FILE or postgresql://… (else SILO_DATABASE_URL)"})
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
        print(f"missing: the file {checksum} is lost or damaged in the server's store", file=sys.stderr)
    text = f"Backup {args.target}: {sum(made.rows.values())} rows, {made.files} files."
    print(json.dumps(asdict(made)) if args.json else spoken(text))
    return Exit.UNDONE if made.missing_files else Exit.DONE


def run_restore(args: argparse.Namespace) -> int:
    """Replace the server's state by a backup, or with ``--verify`` only check that the backup is whole."""
    need_server_extra()
    from silo_server.backup import restore, verify
    from silo_server.settings import settings_from_environment

    if args.verify:
        made = verify(args.source)
        text = f"The backup of {made.made_at} is whole: {sum(made.rows.values())} rows, {made.files} files."
    else:
        settings = settings_from_environment(database_url=args.database, files_dir=args.files)
        made = restore(settings, args.source, replace=args.replace, report=_report)
        text = f"Restored the backup of {made.made_at}: {sum(made.rows.values())} rows, {made.files} files."
    print(json.dumps(asdict(made)) if args.json else spoken(text))
    return Exit.DONE


def _report(text: str) -> None:
    print(text, file=sys.stderr)


# Windows takes Ctrl-C between two waits, never within one.
_CTRL_C_S = 0.5


def add_watch(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--count", type=above_zero, metavar="N", help="end after N events")
    parser.set_defaults(ends_with_its_reader=True, waits=True)


def run_watch(args: argparse.Namespace) -> int:
    """Print events until stopped; the connection is made again whenever it is lost."""
    from silo.api.events import EventListener

    events: queue.Queue[ServerEvent | ConnectionState] = queue.Queue()
    with client_of(args) as client:
        with suppress(NotFoundError):  # a server that does not say who we are has answered anyway
            client.whoami()  # a wrong address or token is reported at once, not retried
        if args.item:
            args.item = named_item(client, args.item).part_number
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
                json_text(
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
    from silo.cli.show import activity_box, console, plain

    out = console()
    if event.merge is not None:
        url = client.web_url(event.merge.resolve_url) if event.merge.resolve_url else ""
        out.print(activity_box(activity_text(event.merge.item, event.merge, resolve_url=url)))
        return
    out.print(plain(f"{event.type}  {event.item or ''}"), markup=False)


LOGIN_SECONDS = 600


def add_login(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("url", metavar="URL", help="address of the Silo server")
    parser.add_argument("--token", help="API token (else the browser asks you, or standard input has it)")
    add_options(
        parser,
        {
            "--paste": "type the token at the terminal, without a browser",
            "--ca FILE": "certificate authorities to trust",
        },
    )
    parser.set_defaults(waits=True)


def run_login(args: argparse.Namespace) -> int:
    """Save the server and the token if they work; writes nothing if the server refuses them."""
    from silo.api.client import SiloClient
    from silo.api.config import config_path, resolve_server, save_config
    from silo.outbox.store import Store

    token = args.token or _token_by_browser(args) or _token(args.url)
    where = resolve_server(args.url, token, args.ca, env={}, path=config_path())
    with SiloClient(where.url, where.token, verify=where.verify) as client:
        client.ready()
        name, role = account_of(client)
    path = save_config(where.url, where.token, where.verify)
    if (store := Store()).path.exists():
        store.resume(where.url, told=False)  # the pause of a wrong token
    if args.json:
        data = {"url": client.base_url, "username": name, "role": role, "configuration": str(path)}
        print_json(data)
    else:
        who = ", ".join(filter(None, (name, role))) or "this server does not say who you are"
        print(spoken(f"{client.base_url}: {who}. Kept in {path}, which only you can read."))
    return Exit.DONE


def _token_by_browser(args: argparse.Namespace) -> str:
    """Let a person allow a new token on the server's page, and return it; "" without a terminal or such a
    page.
    """
    if args.paste or not sys.stdin.isatty():
        return ""
    from silo.api.client import SiloClient
    from silo.api.config import config_path, resolve_server

    where = resolve_server(args.url, None, args.ca, env={}, path=config_path())
    with SiloClient(where.url, None, verify=where.verify) as client:
        login = client.begin_login("silo-mod")
    if login is None:
        return ""
    print(
        f"Open this page and let silo-mod in; it shows the code {login.code}:\n{login.page}", file=sys.stderr
    )
    webbrowser.open(login.page)
    with SiloClient(where.url, login.token, verify=where.verify) as client:
        for _ in range(LOGIN_SECONDS):
            with suppress(AuthError):
                client.whoami()
                return login.token
            time.sleep(1)
    raise AuthError(f"nobody let silo-mod in within {LOGIN_SECONDS // 60} minutes; begin again")


def _token(url: str) -> str:
    if sys.stdin.isatty():
        token = getpass.getpass(spoken(f"API token of {url} (its page “API tokens” makes one): "))
    else:
        token = sys.stdin.readline()
    if not token.strip():
        raise InputError("no token was given; nothing was changed")
    return token.strip()


NOBODY = "00000000-0000-4000-8000-000000000000"
# One package of each extra, and what the extra is for.
_EXTRAS = {"server": ("fastapi", "serve, demo"), "inertia": ("OCP", "inertia, mass, links")}
Rows = dict[str, "str | SiloError"]
T = TypeVar("T")


def run_doctor(args: argparse.Namespace) -> int:
    """Print what was found; returns 2 or 3 if something that the commands need does not work."""
    checks = {**_machine(), **_server(args)}
    failed = {name: value for name, value in checks.items() if isinstance(value, SiloError)}
    if args.json:
        print_json({"ok": not failed, **{name: str(value) for name, value in checks.items()}})
    else:
        from silo.cli.show import plain

        width = max(map(len, map(spoken, checks)))
        for name, value in checks.items():
            text = f"{spoken(name):<{width}}  {plain(spoken(str(value)))}"
            print(f"{'✗' if name in failed else ' '} {text}")
    return max((exit_of(error) for error in failed.values()), default=Exit.DONE)


def _machine() -> Rows:
    """Describe this machine: versions, folders, extras, FreeCAD and the add-on in it."""
    from silo.freecads import material_folders
    from silo.platform import cache_folder, data_folder

    place = _tried(_freecad)
    return {
        "silo-mod": _tried(_program),
        "configuration": _tried(_configuration),
        "data": _folder(data_folder()),
        "cache": _folder(cache_folder()),
        **{name: _extra(name, *about) for name, about in _EXTRAS.items()},
        "FreeCAD": place if isinstance(place, (str, SiloError)) else place[0],
        **({} if isinstance(place, (str, SiloError)) else {"add-on": _tried(lambda: _addon(place[1]))}),
        "materials": _listed(map(str, material_folders())),
    }


def _program() -> str:
    """Return the versions of silo-mod and Python; ConfigError if another distribution has a package of the
    same name.
    """
    names = {name.replace("_", "-") for name in importlib.metadata.packages_distributions().get("silo", ())}
    if others := sorted(names - {"silo-mod"}):
        raise ConfigError(
            f"{', '.join(others)} also has a package named silo, in the same place. Uninstall it, and "
            "install silo-mod again"
        )
    return f"{importlib.metadata.version('silo-mod')}, Python {sys.version.split()[0]}"


def _configuration() -> str:
    from silo.api.config import checked_config, config_path

    path = config_path()
    checked_config(path)
    return str(path) if path.exists() else f"{path} (none yet; everything has a default)"


def _folder(path: os.PathLike[str]) -> str | SiloError:
    """Return the folder, which need not exist yet; an error if nothing can be written to it."""
    there = os.fspath(path)
    while not os.path.lexists(there) and os.path.dirname(there) != there:
        there = os.path.dirname(there)
    if not (os.path.isdir(there) and os.access(there, os.W_OK)):
        return ConfigError(f"{path}: {there} is no folder that you can write to; SILO_HOME names another one")
    return str(path)


def _extra(name: str, package: str, used_by: str) -> str:
    if importlib.util.find_spec(package) is not None:
        return f"the extra is installed ({used_by})"
    return f"not installed ({used_by} need it): pip install 'silo-mod[{name}]'"


def _freecad() -> str | tuple[str, Installation]:
    from silo.freecads import ask_freecad, commands, find_freecadcmd

    if not os.environ.get("SILO_FREECADCMD") and next(commands(), None) is None:
        return "none found (files are read without it; only the add-on and bom --verify need one)"
    command = find_freecadcmd()
    place = ask_freecad(command)
    others = [path for path in commands() if path != command]
    versions = "{}.{}, Python {}.{}".format(*place.freecad, *place.python)
    return f"{command}: {versions}" + (f"; also {_listed(others)}" if others else ""), place


def _addon(place: Installation) -> str:
    if not place.mod.exists():
        return f"not in {place.mod}: silo-mod install-addon puts it there"
    if place.missing:
        lacks = ", ".join(f"{name} ({reason})" for name, reason in place.missing.items())
        them = "it" if len(place.missing) == 1 else "them"
        return f"{place.mod}, without {lacks}: silo-mod install-addon installs {them}"
    return str(place.mod)


def _listed(texts: Iterable[str]) -> str:
    return ", ".join(texts) or "none found"


def _server(args: argparse.Namespace) -> Rows:
    from silo.api.abilities import Abilities
    from silo.api.config import resolve_server

    try:
        where = resolve_server(args.server, args.token)
        with client_of(args) as client:
            client.abilities = Abilities()  # looked at again, and kept for the other commands
            return {
                "address": f"{client.base_url} (from {where.url_from})",
                "token": f"from {where.token_from}" if where.token else "none",
                **look(client, args.schema),
            }
    except ConfigError as error:
        return {"address": error}


def look(client: SiloClient, schema: str) -> dict[str, Any]:
    """Ask for each fact; an error is an answer too."""
    return {
        "mode": _tried(lambda: _mode(client)),
        "who": _tried(lambda: _who(client)),
        "items": _tried(lambda: (client.search_items(limit=1), "can be read")[1]),
        "identities": _tried(lambda: _identities(client)),
        "schema": _tried(lambda: client.find_schema(schema)),
        "modules": _tried(lambda: _modules(client)),
        "events": _tried(lambda: _events(client)),
    }


def _tried(ask: Callable[[], T]) -> T | SiloError:
    try:
        return ask()
    except SiloError as error:
        return error


def _mode(client: SiloClient) -> str:
    state = client.ready()
    return f"{state.mode}, version {state.version}" if state.version else state.mode


def _who(client: SiloClient) -> str:
    try:
        user = client.whoami()
    except NotFoundError:
        return "the server does not say"
    writes = " (reads only: register, sync and push need an editor)" if user.role == "viewer" else ""
    return f"{user.username}, {user.role}{writes}" if user.role else user.username


def _identities(client: SiloClient) -> str:
    client.get_items_by_uuid([NOBODY])
    return "many in one question" if client.abilities.batch else "one by one"


def _modules(client: SiloClient) -> str:
    try:
        return ", ".join(client.modules()) or "none are named"
    except (NotFoundError, ForbiddenError):
        return "the server does not say"


def _events(client: SiloClient) -> str:
    client.open_events().close()
    return "live"


def add_install_addon(parser: argparse.ArgumentParser) -> None:
    add_options(
        parser,
        {
            "--freecadcmd PATH": "freecadcmd (default: found on the PATH)",
            "--freecad-data DIR": "its data folder (default: FreeCAD is asked)",
            "--copy": "copy the add-on, do not link to this checkout",
        },
    )


def run_install_addon(args: argparse.Namespace) -> int:
    """Install the add-on, and print where it is."""
    from silo.freecads import ask_freecad, install_folder, install_packages

    place = ask_freecad(args.freecadcmd, Path(args.freecad_data) if args.freecad_data else None)
    report = {
        "freecad": "FreeCAD {}.{} with Python {}.{}".format(*place.freecad, *place.python),
        "addon": str(install_folder(place, copy=args.copy)),
        "packages": str(install_packages(place)),
    }
    if args.json:
        print_json(report)
    else:
        text = f"{report['freecad']}\nAdd-on:   {report['addon']}\nPackages: {report['packages']}"
        print(spoken(f"{text}\nStart FreeCAD again, and choose the workbench Silo."))
    return Exit.DONE


def add_schema(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="COMMAND", nargs="?", help="the command (default: list them)")


def run_schema(args: argparse.Namespace) -> int:
    """Print one schema, or the names of all."""
    from silo.cli.shapes import NAMES, schema_of

    if args.name is not None:
        print_json(schema_of(args.name))
    elif args.json:
        print_json(NAMES)
    else:
        print("\n".join(NAMES))
    return Exit.DONE
