# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod watch``: the server's events as they happen."""

from __future__ import annotations

import argparse
import queue
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

from silo.bom.errors import AuthError, Exit, NotFoundError, PackageError, RouteMissingError
from silo.bom.message import message
from silo.bom_sync.activity_text import activity_text
from silo.cli.connection import client_of, named_item
from silo.cli.json_output import json_text
from silo.cli.options import above_zero

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.events import ConnectionState
    from silo.api.sse import ServerEvent


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
                raise RouteMissingError(
                    message("there is no live connection: {message}", message=event.message)
                )
            if event.kind is Connection.NO_READER:
                raise PackageError(
                    message("{message}; install it with: pip install sseclient-py", message=event.message)
                )
            if event.kind is Connection.REFUSED:
                raise AuthError(message("the live connection ended: {message}", message=event.message))
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
    from silo.cli.sync_display import activity_box
    from silo.cli.terminal import console, plain

    out = console()
    if event.merge is not None:
        url = client.web_url(event.merge.resolve_url) if event.merge.resolve_url else ""
        out.print(activity_box(activity_text(event.merge.item, event.merge, resolve_url=url)))
        return
    out.print(plain(f"{event.type}  {event.item or ''}"), markup=False)
