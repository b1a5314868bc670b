# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod search``, ``show``, ``whoami``, ``logout`` and ``completion``."""

from __future__ import annotations

import argparse
import os
from typing import Any

from silo.bom.errors import ConfigError, Exit, NotFoundError
from silo.cli import common, show


def add_search(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("words", metavar="WORD", nargs="+")
    parser.add_argument(
        "--limit", metavar="N", type=common.above_zero, default=20, help="at most N items (20)"
    )
    parser.set_defaults(run=run_search)


def add_show(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("part_number", metavar="PART_NUMBER")
    parser.set_defaults(run=run_show)


def add_whoami(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=run_whoami)


def add_logout(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=run_logout)


def add_completion(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("shell", choices=("bash", "zsh", "tcsh"))
    parser.set_defaults(run=run_completion)


def run_search(args: argparse.Namespace) -> int:
    """Print the items; 1 if there is none."""
    with common.client_of(args) as client:
        found = client.search_items(" ".join(args.words), limit=args.limit)
    rows = [{name: getattr(item, name) for name in ("part_number", "name", "item_type")} for item in found]
    if args.json:
        common.print_json(rows)
    else:
        _print(rows or [{"part_number": "No item has these words."}])
    return Exit.DONE if rows else Exit.UNDONE


def run_show(args: argparse.Namespace) -> int:
    """Print the item and its lines."""
    with common.client_of(args) as client:
        item = common.named_item(client, args.part_number)
        lines = client.get_bom(item.part_number)
        page = client.web_url(f"/items/{item.part_number}")
    head = {name: getattr(item, name) for name in ("part_number", "name", "item_type", "current_revision")}
    rows: list[dict[str, Any]] = [
        {
            "part_number": line.child_part_number,
            "name": line.child_name or line.child_description,
            "quantity": line.quantity,
            "source": line.source,
        }
        for line in lines
    ]
    if args.json:
        common.print_json({**head, "page": page, "bom": rows})
        return Exit.DONE
    _print([{**head, "current_revision": f"revision {item.current_revision}"}])
    _print(rows)
    print(page)
    return Exit.DONE


def run_whoami(args: argparse.Namespace) -> int:
    """Print the address, where it comes from, and the user."""
    from silo.api.config import resolve_server

    where = resolve_server(args.server, args.token)
    with common.client_of(args) as client:
        told: dict[str, Any] = {
            "url": client.base_url,
            "from": where.url_from,
            "username": None,
            "role": None,
        }
        try:
            user = client.whoami()
            told |= {"username": user.username, "role": user.role or None}
        except NotFoundError:
            client.search_items(limit=1)
    if args.json:
        common.print_json(told)
    else:
        who = ", ".join(filter(None, (told["username"], told["role"])))
        print(
            show.plain(
                f"{told['url']} (from {told['from']}): {who or 'this server does not say who you are'}"
            )
        )
    return Exit.DONE


def run_logout(args: argparse.Namespace) -> int:
    """Remove the configuration that ``login`` wrote; a token in the environment stays."""
    from silo.api.config import checked_config, config_path
    from silo.platform import remove_patiently

    path = config_path()
    there = path.exists()
    if there:
        checked_config(path)  # what is not ours stays
        remove_patiently(path)
    if args.json:
        common.print_json({"configuration": str(path), "removed": there})
    else:
        print(f"{path} is removed." if there else f"There was no {path}; nothing is remembered.")
        if os.environ.get("SILO_API_TOKEN"):
            print("SILO_API_TOKEN still has a token.")
    return Exit.DONE


def run_completion(args: argparse.Namespace) -> int:
    """Print the script of a shell. ConfigError if shtab is not installed."""
    try:
        import shtab
    except ImportError:
        raise ConfigError("completion needs the package shtab: pip install 'silo-mod[completion]'") from None
    from silo.cli.main import build_parser

    print(shtab.complete(build_parser(), args.shell))
    return Exit.DONE


def _print(rows: list[dict[str, Any]]) -> None:
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, show_header=False)
    for row in rows:
        table.add_row(*(Text(show.plain("" if value is None else str(value))) for value in row.values()))
    if rows:
        show.console().print(table)
