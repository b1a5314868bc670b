# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod doctor``: what is where on this machine, which server is meant, what fails. Changes nothing."""

from __future__ import annotations

import argparse
import importlib.metadata
import importlib.util
import os
import shutil
import sys
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, TypeVar

from silo import spoken
from silo.bom.errors import ConfigError, Exit, ForbiddenError, NotFoundError, SiloError, counted, exit_of
from silo.bom.message import joined, message
from silo.cli.connection import client_of
from silo.cli.json_output import print_json
from silo.cli.options import add_options

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.freecads.addon import Installation


NOBODY = "00000000-0000-4000-8000-000000000000"

# One package of each extra, and what the extra is for.
_EXTRAS = {"server": ("fastapi", "serve, demo"), "inertia": ("OCP", "inertia, mass, links")}

Rows = dict[str, "str | SiloError"]

T = TypeVar("T")


def add_doctor(parser: argparse.ArgumentParser) -> None:
    text = message(
        "delete what is remembered of files and servers (the cache); commits and the configuration stay"
    )
    add_options(parser, {"--clean": text})


# What can be made again, by its name in the cache. On Windows the same folder holds commits that wait; old
# revisions that were opened may have edits; locks are in use.
_CACHED = ("documents.sqlite3*", "geometry", "servers.json", "unreferenced.json")


def _clean() -> str:
    """Delete what is remembered in the cache, and return how much it was."""
    from silo.platform.user_folders import cache_folder
    from silo.platform.whole_files import remove_patiently

    folder = cache_folder()
    found = [path for name in _CACHED for path in folder.glob(name)]
    files = [file for path in found for file in (path, *path.rglob("*")) if file.is_file()]
    size = sum(file.stat().st_size for file in files)
    for path in found:
        shutil.rmtree(path) if path.is_dir() else remove_patiently(path)
    return message(
        "{folder}: {files} deleted, {size} MB",
        folder=folder,
        files=counted(len(files), "file"),
        size=f"{size / 1000000.0:.1f}",
    )


def run_doctor(args: argparse.Namespace) -> int:
    """Print what was found; returns 2 or 3 if something that the commands need does not work."""
    if args.clean:
        text = _clean()
        print_json({"ok": True, "cache": text}) if args.json else print(spoken(text))
        return Exit.DONE
    checks = {**_machine(), **_server(args)}
    failed = {name: value for name, value in checks.items() if isinstance(value, SiloError)}
    if args.json:
        print_json({"ok": not failed, **{name: str(value) for name, value in checks.items()}})
    else:
        from silo.cli.terminal import plain

        width = max(map(len, map(spoken, checks)))
        for name, value in checks.items():
            text = f"{spoken(name):<{width}}  {plain(spoken(str(value)))}"
            print(f"{'✗' if name in failed else ' '} {text}")
    return max((exit_of(error) for error in failed.values()), default=Exit.DONE)


def _machine() -> Rows:
    """Describe this machine: versions, folders, extras, FreeCAD and the add-on in it."""
    from silo.freecads.places import material_folders
    from silo.platform.user_folders import cache_folder, data_folder

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
            message(
                "{others} also has a package named silo, in the same place. Uninstall it, and "
                "install silo-mod again",
                others=", ".join(others),
            )
        )
    return message(
        "{version}, Python {python}",
        version=importlib.metadata.version("silo-mod"),
        python=sys.version.split()[0],
    )


def _configuration() -> str:
    from silo.api.config import checked_config, config_path

    path = config_path()
    checked_config(path)
    return str(path) if path.exists() else message("{path} (none yet; everything has a default)", path=path)


def _folder(path: os.PathLike[str]) -> str | SiloError:
    """Return the folder, which need not exist yet; an error if nothing can be written to it."""
    there = os.fspath(path)
    while not os.path.lexists(there) and os.path.dirname(there) != there:
        there = os.path.dirname(there)
    if not (os.path.isdir(there) and os.access(there, os.W_OK)):
        return ConfigError(
            message(
                "{path}: {there} is no folder that you can write to; SILO_HOME names another one",
                path=path,
                there=there,
            )
        )
    return str(path)


def _extra(name: str, package: str, used_by: str) -> str:
    if importlib.util.find_spec(package) is not None:
        return message("the extra is installed ({used_by})", used_by=used_by)
    return message(
        "not installed ({used_by} need it): pip install 'silo-mod[{name}]'", used_by=used_by, name=name
    )


def _freecad() -> str | tuple[str, Installation]:
    from silo.freecads.addon import ask_freecad
    from silo.freecads.places import commands
    from silo.freecads.run import find_freecadcmd

    if not os.environ.get("SILO_FREECADCMD") and next(commands(), None) is None:
        return message("none found (files are read without it; only the add-on and bom --verify need one)")
    command = find_freecadcmd()
    place = ask_freecad(command)
    others = [path for path in commands() if path != command]
    versions = "{}.{}, Python {}.{}".format(*place.freecad, *place.python)
    return message("{command}: {versions}", command=command, versions=versions) + (
        message("; also {others}", others=_listed(others)) if others else ""
    ), place


def _addon(place: Installation) -> str:
    if not place.mod.exists():
        return message("not in {mod}: `silo-mod install-addon` puts it there", mod=place.mod)
    if place.missing:
        lacks = joined(
            ", ",
            (
                message("{name} ({reason})", name=name, reason=reason)
                for name, reason in place.missing.items()
            ),
        )
        them = "it" if len(place.missing) == 1 else "them"
        return message(
            "{mod}, without {lacks}: `silo-mod install-addon` installs {them}",
            mod=place.mod,
            lacks=lacks,
            them=them,
        )
    return str(place.mod)


def _listed(texts: Iterable[str]) -> str:
    return ", ".join(texts) or message("none found")


def _server(args: argparse.Namespace) -> Rows:
    from silo.api.abilities import Abilities
    from silo.api.config import resolve_server
    from silo.cli.setup.site_checks import site

    try:
        where = resolve_server(args.server, args.token)
        with client_of(args) as client:
            client.abilities = Abilities()  # looked at again, and kept for the other commands
            return {
                "address": message(
                    "{base_url} (from {url_from})", base_url=client.base_url, url_from=where.url_from
                ),
                "token": message("from {token_from}", token_from=where.token_from) if where.token else "none",
                **look(client, args.schema),
                **(site(client, where.verify) if args.server else {}),
            }
    except ConfigError as error:
        return {"address": error}


def look(client: SiloClient, schema: str) -> dict[str, Any]:
    """Ask for each fact; an error is an answer too."""
    return {
        "mode": _tried(lambda: _mode(client)),
        "who": _tried(lambda: _who(client)),
        "items": _tried(lambda: (client.search_items(limit=1), message("can be read"))[1]),
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
    return (
        message("{mode}, version {version}", mode=state.mode, version=state.version)
        if state.version
        else state.mode
    )


def _who(client: SiloClient) -> str:
    try:
        user = client.whoami()
    except NotFoundError:
        return message("the server does not say")
    writes = message(" (reads only: register, sync and push need an editor)") if user.role == "viewer" else ""
    return joined("", (user.username, ", ", user.role, writes)) if user.role else user.username


def _identities(client: SiloClient) -> str:
    client.get_items_by_uuid([NOBODY])
    return message("many in one question") if client.abilities.batch else message("one by one")


def _modules(client: SiloClient) -> str:
    try:
        return ", ".join(client.modules()) or message("none are named")
    except (NotFoundError, ForbiddenError):
        return message("the server does not say")


def _events(client: SiloClient) -> str:
    client.open_events().close()
    return "live"
