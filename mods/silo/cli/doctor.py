# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod doctor``: which server, whether it answers, who we are there, and what it can do."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from silo.bom.errors import ForbiddenError, NotFoundError, SiloError
from silo.cli import common
from silo.cli.common import Commands

if TYPE_CHECKING:
    from silo.api.client import SiloClient

NOBODY = "00000000-0000-4000-8000-000000000000"


def register(commands: Commands) -> None:
    """Add the command."""
    parser = common.add_command(
        commands,
        "doctor",
        "show which server is meant, whether it answers, and what it can do; changes nothing",
        "silo-mod doctor",
    )
    parser.add_argument("--schema", default="kindred-rd", help="part number schema (default: kindred-rd)")
    common.add_json_option(parser)
    common.add_server_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print what was found; 3 where something that the commands need does not work."""
    from silo.api.abilities import Abilities
    from silo.api.config import resolve_server

    where = resolve_server(args.server, args.token)
    with common.client_of(args) as client:
        client.abilities = Abilities()  # looked at anew, and kept for the other commands
        found = look(client, args.schema)
    rows = {
        "address": f"{client.base_url} (from {where.url_from})",
        "token": f"from {where.token_from}" if where.token else "none",
        **{name: str(value) for name, value in found.items()},
    }
    failed = any(isinstance(value, SiloError) for value in found.values())
    if args.json:
        common.print_json({"ok": not failed, **rows})
    else:
        from silo.cli import show

        width = max(map(len, rows))
        for name, text in rows.items():
            mark = "✗" if isinstance(found.get(name), SiloError) else " "
            print(f"{mark} {name:<{width}}  {show.plain(text)}")
    return 3 if failed else 0


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


def _tried(ask: Callable[[], str]) -> str | SiloError:
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
