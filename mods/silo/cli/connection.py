# SPDX-License-Identifier: LGPL-2.1-or-later
"""The connection of a command to the Silo server: the client, the account, a named item."""

from __future__ import annotations

import argparse
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from silo.bom.entry import Extraction, walk_entries
from silo.bom.errors import InputError, NotFoundError, RouteMissingError, SiloError, duration
from silo.bom.message import message

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.policy import Retries
    from silo.api.wire import Item


@contextmanager
def client_of(
    args: argparse.Namespace, retries: Retries | None = None, *, stop: threading.Event | None = None
) -> Iterator[SiloClient]:
    """Yield a client for the server that the options, the environment or the configuration name.

    retries
        how often and how soon a request is repeated, for a job that may wait.
    stop
        once it is set, no command waits for the server any more.
    """
    from silo.api.abilities import abilities_path
    from silo.api.client import SiloClient
    from silo.api.config import resolve_server
    from silo.api.policy import Retries
    from silo.api.transport import stop_if

    stopped = stop or threading.Event()

    def rest(seconds: float) -> None:
        stopped.wait(seconds)
        stop_if(stopped)

    def tell(seconds: float, error: SiloError) -> None:
        if seconds > 5:
            again = message(
                "It is asked again in {seconds}; Ctrl-C ends this, what was sent stays",
                seconds=duration(seconds),
            )
            print(f"silo-mod: {error}. {again}", file=sys.stderr, flush=True)

    where = resolve_server(getattr(args, "server", None), getattr(args, "token", None))
    retries = replace(retries or Retries(), sleep=rest, tell=tell)
    memory = abilities_path()
    with SiloClient(where.url, where.token, verify=where.verify, memory=memory, retries=retries) as client:
        yield client


def account_of(client: SiloClient) -> tuple[str | None, str | None]:
    """Return the name and the role of the user whose token it is; None where the server does not say.

    Raises SiloError if the server refuses the token.
    """
    try:
        user = client.whoami()
    except NotFoundError:
        client.search_items(limit=1)
        return None, None
    return user.username, user.role or None


def named_item(client: SiloClient, number: str) -> Item:
    """Get the item that a user named. InputError if there is none, since then the name is wrong."""
    try:
        return client.get_item(number)
    except RouteMissingError:
        raise
    except NotFoundError:
        raise InputError(
            message("there is no item {number} on {base_url}", number=number, base_url=client.base_url)
        ) from None


def reach(client: SiloClient, extraction: Extraction | None = None) -> None:
    """Report a wrong address or token even if no component has an identity about which to ask the server."""
    entries = () if extraction is None else walk_entries((extraction.assembly, *extraction.entries))
    if any(entry.silo_uuid for entry in entries):
        return
    with suppress(NotFoundError):  # a server that does not say who we are has answered anyway
        client.whoami()
