# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod login``, ``doctor`` and ``install-addon``: what the other commands need, and what is wrong."""

from __future__ import annotations

import argparse
import getpass
import importlib.metadata
import importlib.util
import os
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from silo.bom.errors import ConfigError, Exit, ForbiddenError, InputError, NotFoundError, SiloError, exit_of
from silo.cli import common
from silo.cli.common import Commands

if TYPE_CHECKING:
    from silo.addon_install import Place
    from silo.api.client import SiloClient


def register(commands: Commands) -> None:
    """Add the commands."""
    _add_login(commands)
    _add_doctor(commands)
    _add_install_addon(commands)
    _add_schema(commands)


def _add_login(commands: Commands) -> None:
    parser = common.add_command(
        commands,
        "login",
        "try a server's address and a token, and remember both for this user",
        "silo-mod login https://silo.example.com",
    )
    parser.add_argument("url", metavar="URL", help="address of the Silo server")
    parser.add_argument("--token", help="API token (else it is asked for, or read from standard input)")
    parser.add_argument("--ca", metavar="FILE", help="certificate authorities to trust")
    common.add_json_option(parser)
    parser.set_defaults(run=run_login)


def run_login(args: argparse.Namespace) -> int:
    """Save what was seen to work; nothing is written where the server refuses."""
    from silo.api.client import SiloClient
    from silo.api.config import config_path, resolve_server, save_config

    where = resolve_server(args.url, args.token or _token(args.url), args.ca, env={}, path=config_path())
    with SiloClient(where.url, where.token, verify=where.verify) as client:
        client.ready()
        name, role = None, None
        try:
            user = client.whoami()
            name, role = user.username, user.role or None
        except NotFoundError:
            client.search_items(limit=1)
    path = save_config(where.url, where.token, where.verify)
    if args.json:
        data = {"url": client.base_url, "username": name, "role": role, "configuration": str(path)}
        common.print_json(data)
    else:
        who = ", ".join(filter(None, (name, role))) or "this server does not say who you are"
        print(f"{client.base_url}: {who}. Kept in {path}, which only you can read.")
    return Exit.DONE


def _token(url: str) -> str:
    if sys.stdin.isatty():
        token = getpass.getpass(f"API token of {url} (its page “API tokens” makes one): ")
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


def _add_doctor(commands: Commands) -> None:
    parser = common.add_command(
        commands,
        "doctor",
        "show what is where on this machine, which server is meant, and what does not work; changes nothing",
        "silo-mod doctor",
    )
    parser.add_argument("--schema", default="kindred-rd", help="part number schema (default: kindred-rd)")
    common.add_json_option(parser)
    common.add_server_options(parser)
    parser.set_defaults(run=run_doctor)


def run_doctor(args: argparse.Namespace) -> int:
    """Print what was found; 2 or 3 where something that the commands need does not work."""
    found = {**_machine(), **_server(args)}
    failed = {name: value for name, value in found.items() if isinstance(value, SiloError)}
    if args.json:
        common.print_json({"ok": not failed, **{name: str(value) for name, value in found.items()}})
    else:
        from silo.cli import show

        width = max(map(len, found))
        for name, value in found.items():
            print(f"{'✗' if name in failed else ' '} {name:<{width}}  {show.plain(str(value))}")
    return max((exit_of(one) for one in failed.values()), default=Exit.DONE)


def _machine() -> Rows:
    """This machine: versions, folders, extras, FreeCAD and the add-on in it."""
    from silo.folders import cache_folder, data_folder
    from silo.freecads import material_folders

    place = _tried(_freecad)
    return {
        "silo-mod": f"{importlib.metadata.version('silo-mod')}, Python {sys.version.split()[0]}",
        "configuration": _tried(_configuration),
        "data": _folder(data_folder()),
        "cache": _folder(cache_folder()),
        **{name: _extra(name, *about) for name, about in _EXTRAS.items()},
        "FreeCAD": place if isinstance(place, (str, SiloError)) else place[0],
        **({} if isinstance(place, (str, SiloError)) else {"add-on": _tried(lambda: _addon(place[1]))}),
        "materials": _listed(map(str, material_folders())),
    }


def _configuration() -> str:
    from silo.api.config import checked_config, config_path

    path = config_path()
    checked_config(path)
    return str(path) if path.exists() else f"{path} (none yet; everything has a default)"


def _folder(path: os.PathLike[str]) -> str | SiloError:
    """The folder, which need not be there yet; an error where nothing can be written to it."""
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


def _freecad() -> str | tuple[str, Place]:
    from silo.addon_install import ask_freecad
    from silo.freecadcmd.run import find_freecadcmd
    from silo.freecads import commands

    if not os.environ.get("SILO_FREECADCMD") and next(commands(), None) is None:
        return "none found (files are read without it; only --via freecad and the add-on need one)"
    command = find_freecadcmd()
    place = ask_freecad(command)
    others = [one for one in commands() if one != command]
    versions = "{}.{}, Python {}.{}".format(*place.freecad, *place.python)
    return f"{command}: {versions}" + (f"; also {_listed(others)}" if others else ""), place


def _addon(place: Place) -> str:
    if not place.mod.exists():
        return f"not in {place.mod}: silo-mod install-addon puts it there"
    if place.missing:
        return f"{place.mod}, without {', '.join(place.missing)}: silo-mod install-addon installs them"
    return str(place.mod)


def _listed(texts: Iterable[str]) -> str:
    return ", ".join(texts) or "none found"


def _server(args: argparse.Namespace) -> Rows:
    from silo.api.caller import Abilities
    from silo.api.config import resolve_server

    try:
        where = resolve_server(args.server, args.token)
        with common.client_of(args) as client:
            client.abilities = Abilities()  # looked at anew, and kept for the other commands
            return {
                "address": f"{client.base_url} (from {where.url_from})",
                "token": f"from {where.token_from}" if where.token else "none",
                **look(client, args.schema),
            }
    except ConfigError as error:
        return {"address": error}


def look(client: SiloClient, schema: str) -> dict[str, Any]:
    """Ask for each thing; an error is an answer too."""
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


def _add_install_addon(commands: Commands) -> None:
    parser = common.add_command(
        commands,
        "install-addon",
        "put the add-on and its Python packages into a FreeCAD found on this machine",
        "silo-mod install-addon --freecadcmd /usr/bin/freecadcmd",
    )
    parser.add_argument("--freecadcmd", metavar="PATH", help="freecadcmd (default: found on the PATH)")
    parser.add_argument("--freecad-data", metavar="DIR", help="its data folder (default: FreeCAD is asked)")
    parser.add_argument("--copy", action="store_true", help="copy the add-on, do not link to this checkout")
    common.add_json_option(parser)
    parser.set_defaults(run=run_install_addon)


def run_install_addon(args: argparse.Namespace) -> int:
    """Install, and say where."""
    from silo.addon_install import ask_freecad, install_folder, install_packages

    place = ask_freecad(args.freecadcmd, Path(args.freecad_data) if args.freecad_data else None)
    found = {
        "freecad": "FreeCAD {}.{} with Python {}.{}".format(*place.freecad, *place.python),
        "addon": str(install_folder(place, copy=args.copy)),
        "packages": str(install_packages(place)),
    }
    if args.json:
        common.print_json(found)
    else:
        print(f"{found['freecad']}\nAdd-on:   {found['addon']}\nPackages: {found['packages']}")
        print("Start FreeCAD again, and choose the workbench Silo.")
    return Exit.DONE


def _add_schema(commands: Commands) -> None:
    parser = common.add_command(
        commands,
        "schema",
        "print the JSON Schema of what a command prints with --json",
        "silo-mod schema bom > bom.schema.json",
    )
    parser.add_argument("name", metavar="COMMAND", nargs="?", help="the command (default: list them)")
    common.add_json_option(parser)
    parser.set_defaults(run=run_schema)


def run_schema(args: argparse.Namespace) -> int:
    """Print one schema, or the names of all."""
    from silo.cli.shapes import NAMES, schema_of

    if args.name is not None:
        common.print_json(schema_of(args.name))
    elif args.json:
        common.print_json(NAMES)
    else:
        print("\n".join(NAMES))
    return Exit.DONE
