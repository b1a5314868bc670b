# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod register --orphans``: the items of interrupted registrations, which no file names."""

from __future__ import annotations

import argparse
import os
import sys

from silo.bom.errors import Exit
from silo.bom.message import message
from silo.cli.connection import client_of
from silo.cli.json_output import print_json
from silo.cli.terminal import plain
from silo.registering.items import finished
from silo.registering.journal import Journal


def orphans(args: argparse.Namespace) -> int:
    """List the items that no file names, or archive them; returns 1 if any are left."""
    journal, rows, done = Journal(), [], args.orphans == "archive"
    base = os.path.join(os.path.realpath(args.top), "")
    with client_of(args) as client:
        for record in journal.unfinished():
            if not os.path.join(record.component.rpartition("#")[0], "").startswith(base):
                continue
            items = filter(None, map(client.get_item_by_uuid, {record.item_id, record.wanted}))
            if (item := next(items, None)) is None or finished(record, journal):
                continue
            if done:
                client.archive_item(item.part_number)
                journal.forget(record.component)
            rows.append({"part_number": item.part_number, "name": item.name, "component": record.component})
    if args.json:
        print_json({"archived" if done else "orphans": rows})
    for row in rows if not args.json else ():
        print(*map(plain, (row["part_number"], row["name"], row["component"])), sep="  ")
    if rows and not done:
        words = message(
            "registering these files again takes the items; --orphans archive puts them out of use"
        )
        print(f"silo-mod: {words}", file=sys.stderr)
    return Exit.UNDONE if rows and not done else Exit.DONE
