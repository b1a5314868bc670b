# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the commands share: options, opening files, reaching the server."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from silo.bom.errors import NotFoundError
from silo.bom.findings import respelt_findings
from silo.bom.identity import walk_entries
from silo.bom.links import extract
from silo.bom.model import Extraction
from silo.bom.roots import choose_assembly

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.bom_sync import Resolved

Commands = Any  # argparse keeps the type of its sub-parsers to itself


def add_command(commands: Commands, name: str, help_text: str, example: str) -> argparse.ArgumentParser:
    """A sub-command with its help and an example."""
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=help_text,
        description=help_text[0].upper() + help_text[1:] + ".",
        epilog=f"example:\n  {example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    return parser


def add_server_options(parser: argparse.ArgumentParser) -> None:
    """``--server`` and ``--token``."""
    group = parser.add_argument_group("server")
    group.add_argument("--server", metavar="URL", help="address of the Silo server (else SILO_API_URL)")
    group.add_argument("--token", help="API token (else SILO_API_TOKEN, which other users cannot read)")


def add_assembly_options(parser: argparse.ArgumentParser) -> None:
    """``TOP.FCStd`` and ``--assembly``."""
    parser.add_argument("top", metavar="TOP.FCStd", help="the assembly's file")
    parser.add_argument("--assembly", metavar="NAME", help="the assembly to read, where a file holds several")
    add_hardware_option(parser)


def add_hardware_option(parser: argparse.ArgumentParser) -> None:
    """``--no-hardware``."""
    parser.add_argument(
        "--no-hardware", action="store_true", help="leave out standard parts (screws, nuts, washers, inserts)"
    )


def add_json_option(parser: argparse.ArgumentParser) -> None:
    """``--json``."""
    parser.add_argument("--json", action="store_true", help="print JSON for machines")


@contextmanager
def client_of(args: argparse.Namespace) -> Iterator[SiloClient]:
    """A client for the server that the options, the environment or the configuration name."""
    from silo.api.abilities import default_path
    from silo.api.client import SiloClient
    from silo.api.config import resolve_server

    where = resolve_server(getattr(args, "server", None), getattr(args, "token", None))
    with SiloClient(where.url, where.token, verify=where.verify, memory=default_path()) as client:
        yield client


def read_assembly(top: str, assembly: str | None = None, *, hardware: bool = True) -> Extraction:
    """The BOM of a file, read without FreeCAD; missing files come with the ones that were probably meant."""
    from silo.fcstd import Library
    from silo.fcstd.suggest import with_suggestions

    with Library() as library:
        document = library.open(top)
        found = extract(choose_assembly(document, assembly), hardware=hardware)
        told = respelt_findings(library.notes, document.FileName)
    return with_suggestions(replace(found, findings=(*found.findings, *told)))


def suggest_by_identity(
    extraction: Extraction,
    whole: Resolved,
    compared: Iterable[tuple[Resolved, Iterable[Mapping[str, Any]]]],
) -> Resolved:
    """Missing files with the one that carries the identity which the server knows from the last sync."""
    from silo.bom_sync import identities_before
    from silo.fcstd.suggest import with_suggestions

    if not any(entry.missing for entry in walk_entries(extraction.entries)):
        return whole
    known = replace(extraction, findings=whole.findings)
    return replace(whole, findings=with_suggestions(known, identities_before(compared)).findings)


def reach(client: SiloClient, extraction: Extraction) -> None:
    """Tell a wrong address or token also where no component has an identity to ask the server about."""
    if any(entry.silo_uuid for entry in walk_entries((extraction.assembly, *extraction.entries))):
        return
    with suppress(NotFoundError):  # a server that does not tell who we are has answered all the same
        client.whoami()


def print_json(data: Any) -> None:
    """JSON on standard output; escaped where that is not UTF-8, or a file's name is not."""
    print(json_text(data, indent=2))


def json_text(data: Any, indent: int | None = None) -> str:
    """JSON that standard output can take as it is."""
    text = json.dumps(data, indent=indent, ensure_ascii=False)
    unicode = (getattr(sys.stdout, "encoding", None) or "utf-8").lower().replace("-", "") == "utf8"
    try:
        text.encode("utf-8" if unicode else "ascii")
    except UnicodeEncodeError:
        return json.dumps(data, indent=indent)
    return text
