# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod login``: remember a server and a token, once it is seen that both work."""

from __future__ import annotations

import argparse
import getpass
import sys

from silo.bom.errors import InputError, NotFoundError
from silo.cli import common
from silo.cli.common import Commands


def register(commands: Commands) -> None:
    """Add the command."""
    parser = common.add_command(
        commands,
        "login",
        "try a server's address and a token, and remember both for this user",
        "silo-mod login https://silo.example.com",
    )
    parser.add_argument("url", metavar="URL", help="address of the Silo server")
    parser.add_argument("--token", help="API token (else it is asked for, or read from standard input)")
    parser.add_argument("--ca", metavar="FILE", help="certificate authorities to trust")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Save what was seen to work; nothing is written where the server refuses."""
    from silo.api.client import SiloClient
    from silo.api.config import config_path, resolve_server, save_config

    where = resolve_server(args.url, args.token or _token(args.url), args.ca, env={}, path=config_path())
    with SiloClient(where.url, where.token, verify=where.verify) as client:
        client.ready()
        try:
            user = client.whoami()
            who = f"{user.username}, {user.role}" if user.role else user.username
        except NotFoundError:
            who = "this server does not say who you are"
            client.search_items(limit=1)
    path = save_config(where.url, where.token, where.verify)
    print(f"{client.base_url}: {who}. Kept in {path}, which only you can read.")
    return 0


def _token(url: str) -> str:
    if sys.stdin.isatty():
        token = getpass.getpass(f"API token of {url} (its page “API tokens” makes one): ")
    else:
        token = sys.stdin.readline()
    if not token.strip():
        raise InputError("no token was given; nothing was changed")
    return token.strip()
