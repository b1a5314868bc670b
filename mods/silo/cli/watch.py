# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod watch``: what happens on the server, live."""

from __future__ import annotations

import argparse
import queue
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

from silo.api.activity import activity_text
from silo.bom.errors import AuthError, NotFoundError, RouteMissingError
from silo.cli import common
from silo.cli.common import Commands

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.events import ConnectionState
    from silo.api.sse import ServerEvent

# Windows takes Ctrl-C between two waits, never within one.
_CTRL_C_S = 0.5


def register(commands: Commands) -> None:
    """Add the command."""
    parser = common.add_command(
        commands,
        "watch",
        "show the server's events as they happen (Ctrl-C ends)",
        "silo-mod watch --item A01-0001",
    )
    parser.add_argument("--item", metavar="PART_NUMBER", help="only events of this item")
    parser.add_argument("--count", type=int, metavar="N", help="end after N events")
    common.add_json_option(parser)
    common.add_server_options(parser)
    parser.set_defaults(run=run, ends_with_its_reader=True)


def run(args: argparse.Namespace) -> int:
    """Print events until stopped; the connection is made anew whenever it is lost."""
    from silo.api.events import EventListener

    events: queue.Queue[ServerEvent | ConnectionState] = queue.Queue()
    with common.client_of(args) as client:
        with suppress(NotFoundError):  # a server that does not say who we are has answered all the same
            client.whoami()  # a wrong address or token is reported at once, not retried for ever
        mode = client.ready().mode
        print(f"[{client.base_url}: {mode}]", file=sys.stderr)
        listener = EventListener(client, on_event=events.put, on_state=events.put)
        listener.start()
        try:
            return _print(args, client, events)
        finally:
            listener.stop()


def _print(
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
            _show(client, event)
    return 0


def _show(client: SiloClient, event: ServerEvent) -> None:
    from silo.cli import show

    out = show.console()
    if event.merge is not None:
        url = client.web_url(event.merge.resolve_url) if event.merge.resolve_url else ""
        out.print(show.activity_box(activity_text(event.merge.item, event.merge, resolve_url=url)))
        return
    out.print(show.plain(f"{event.type}  {event.item or ''}"), markup=False)
