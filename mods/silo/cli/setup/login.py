# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod login``, ``whoami`` and ``logout``: the server and the token that are remembered for a user."""

from __future__ import annotations

import argparse
import getpass
import os
import sys
import time
import webbrowser
from typing import TYPE_CHECKING

from silo import caption, spoken
from silo.bom.errors import Exit, InputError, RouteMissingError, SiloError
from silo.bom.message import message
from silo.cli.connection import account_of, client_of
from silo.cli.json_output import print_json
from silo.cli.options import add_options
from silo.cli.terminal import plain

if TYPE_CHECKING:
    pass


def run_whoami(args: argparse.Namespace) -> int:
    """Print the address, where it comes from, and the user."""
    from silo.api.config import resolve_server

    where = resolve_server(args.server, args.token)
    with client_of(args) as client:
        name, role = account_of(client)
        account = {"url": client.base_url, "from": where.url_from, "username": name, "role": role}
    if args.json:
        print_json(account)
    else:
        who = ", ".join(filter(None, (name, role)))
        text = message(
            "{server} (from {source}): {who}",
            server=account["url"],
            source=account["from"],
            who=who or message("this server does not say who you are"),
        )
        print(plain(spoken(text)))
    return Exit.DONE


def run_logout(args: argparse.Namespace) -> int:
    """Remove the configuration that ``login`` wrote; a token in the environment stays."""
    from silo.api.config import checked_config, config_path
    from silo.platform.whole_files import remove_patiently

    path = config_path()
    there = path.exists()
    if there:
        checked_config(path)  # what is not ours stays
        remove_patiently(path)
    if args.json:
        print_json({"configuration": str(path), "removed": there})
    else:
        print(
            spoken(
                message("{path} is removed.", path=path)
                if there
                else message("There was no {path}; nothing is remembered.", path=path)
            )
        )
        if os.environ.get("SILO_API_TOKEN"):
            print(caption("SILO_API_TOKEN still has a token."))
    return Exit.DONE


def add_login(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("url", metavar="URL", help="address of the Silo server")
    parser.add_argument("--token", help="API token (else the browser asks you, or standard input has it)")
    add_options(
        parser,
        {
            "--paste": message("type the token at the terminal, without a browser"),
            "--ca FILE": message("certificate authorities to trust"),
        },
    )
    parser.set_defaults(waits=True)


def run_login(args: argparse.Namespace) -> int:
    """Save the server and the token if they work; writes nothing if the server refuses them."""
    from silo.api.client import SiloClient
    from silo.api.config import config_path, resolve_server, save_config
    from silo.outbox.store import Store

    args.url = _where_the_api_is(args.url, args.ca)
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
        who = ", ".join(filter(None, (name, role))) or message("this server does not say who you are")
        print(
            spoken(
                message(
                    "{base_url}: {who}. Kept in {path}, which only you can read.",
                    base_url=client.base_url,
                    who=who,
                    path=path,
                )
            )
        )
    return Exit.DONE


def _where_the_api_is(url: str, ca: str | None) -> str:
    """Return the address with ``/api`` behind its path, if the API is there and not at the address itself.

    Users copy the address of the pages; below a base path (``https://host/silo``) the API is elsewhere.
    """
    from silo.api.address import ServerAddress
    from silo.api.client import SiloClient
    from silo.api.config import config_path, resolve_server

    where = resolve_server(url, None, ca, env={}, path=config_path())
    address = ServerAddress.parse(where.url)
    if address.api_root.endswith("/api"):
        return url
    for path in ("", "/api"):
        with SiloClient(address.api_root + path, None, verify=where.verify) as client:
            try:
                client.whoami()
            except RouteMissingError:
                continue
            except SiloError:  # it wants a token, or does not answer: the log-in says it
                pass
            return url if not path else address.api_root + path
    return url


def _token_by_browser(args: argparse.Namespace) -> str:
    """Let a user allow a new token on the server's page, and return it; "" without a terminal or such a
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
        message(
            "Open this page and let silo-mod in; it shows the code {code}:\n{page}",
            code=login.code,
            page=login.page,
        ),
        file=sys.stderr,
    )
    webbrowser.open(login.page)
    with SiloClient(where.url, None, verify=where.verify) as client:
        while not login.token:
            time.sleep(login.interval_s)
            login = client.asked_again(login)
    return login.token


def _token(url: str) -> str:
    if sys.stdin.isatty():
        token = getpass.getpass(
            spoken(message("API token of {url} (its page “API tokens” makes one): ", url=url))
        )
    else:
        token = sys.stdin.readline()
    if not token.strip():
        raise InputError(message("no token was given; nothing was changed"))
    return token.strip()
