# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the commands share: options, opening files, reaching the server."""

from __future__ import annotations

import argparse
import json
import os
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.bom.errors import InputError, NotFoundError, RouteMissingError, SiloError
from silo.bom.findings import respelt_findings
from silo.bom.identity import walk_entries
from silo.bom.links import extract
from silo.bom.model import Extraction
from silo.bom.roots import choose_assembly

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.wire import Item
    from silo.vault.plan import Plan
    from silo.vault.reading import Reading

Commands = Any  # argparse keeps the type of its sub-parsers to itself
READING = ("--index", "--no-index", "--jobs", "--dask")


def add_command(commands: Commands, name: str, help_text: str, example: str) -> argparse.ArgumentParser:
    """A sub-command with its help and an example."""
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=help_text,
        description=help_text[0].upper() + help_text[1:] + ".",
        epilog=f"example:\n  {example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,  # --all is no --allow-missing
    )
    return parser


def only_with(parser: argparse.ArgumentParser, needed: str, *options: str) -> None:
    """Refuse ``options`` without the option ``needed``: a person who gave one believes that it did something.

    Several needed ones, as "--apply --plan": any of them.
    """
    needs = parser.get_default("needs") or ()
    parser.set_defaults(needs=(*needs, *((option, needed) for option in options)))


def not_with(parser: argparse.ArgumentParser, other: str, *options: str) -> None:
    """Refuse ``options`` beside the option ``other``, with which they do nothing."""
    excludes = parser.get_default("excludes") or ()
    parser.set_defaults(excludes=(*excludes, *((option, other) for option in options)))


def refuse_idle_options(parser: argparse.ArgumentParser, args: argparse.Namespace) -> None:
    """Raise InputError for an option that would do nothing (:func:`only_with`, :func:`not_with`)."""

    def given(option: str) -> bool:
        name = next(action.dest for action in parser._actions if option in action.option_strings)
        return bool(getattr(args, name) != parser.get_default(name))

    for option, needed in getattr(args, "needs", ()):
        if given(option) and not any(map(given, needed.split())):
            raise InputError(f"{option} does nothing without {' or '.join(needed.split())}")
    for option, other in getattr(args, "excludes", ()):
        if given(option) and given(other):
            raise InputError(f"{option} does nothing with {other}; leave one of them out")


def add_server_options(parser: argparse.ArgumentParser) -> None:
    """``--server`` and ``--token``."""
    group = parser.add_argument_group("server")
    group.add_argument("--server", metavar="URL", help="address of the Silo server (else SILO_API_URL)")
    group.add_argument("--token", help="API token (else SILO_API_TOKEN, which other users cannot read)")


def add_assembly_options(parser: argparse.ArgumentParser, *, folders: bool = False) -> None:
    """``TOP.FCStd`` and ``--assembly``; where the command takes them, whole folders."""
    more = ", or a folder: all assemblies below it" if folders else ""
    parser.add_argument("top", metavar="TOP" if folders else "TOP.FCStd", help=f"the assembly's file{more}")
    parser.add_argument("--assembly", metavar="NAME", help="the assembly to read, where a file holds several")
    add_hardware_option(parser)
    add_reading_options(parser, jobs=folders)


def add_hardware_option(parser: argparse.ArgumentParser) -> None:
    """``--no-hardware``."""
    parser.add_argument(
        "--no-hardware", action="store_true", help="leave out standard parts (screws, nuts, washers, inserts)"
    )


def add_json_option(parser: argparse.ArgumentParser) -> None:
    """``--json``."""
    parser.add_argument("--json", action="store_true", help="print JSON for machines")


def add_reading_options(parser: argparse.ArgumentParser, *, jobs: bool = True) -> None:
    """``--index``, ``--no-index``, and for many files ``--jobs`` and ``--dask``."""
    group = parser.add_argument_group("reading")
    index = group.add_mutually_exclusive_group()
    index.add_argument(
        "--index",
        metavar="FILE",
        type=a_path,
        help="where to remember what files hold (else your cache)",
    )
    index.add_argument("--no-index", action="store_true", help="read every file, and remember nothing")
    if jobs:
        group.add_argument(
            "--jobs", type=job_count, metavar="N", help="processes that read (default: the processors)"
        )
        group.add_argument(
            "--dask", metavar="ADDRESS", help="read on a Dask cluster that sees the same files (extra: dask)"
        )


def a_path(text: str) -> Path:
    """An argument that is a path; an empty one would be the current folder."""
    if not text:
        raise InputError("the name of a file or folder is empty ('')")
    return Path(text)


def job_count(text: str) -> int:
    """How many processes, as an argument."""
    return above_zero(text, most=512)


def above_zero(text: str, most: int = 1_000_000_000) -> int:
    """A count as an argument: a whole number, not 0 and not less."""
    if not text.isascii() or not text.isdigit() or not 1 <= int(text[:20]) <= most:
        raise argparse.ArgumentTypeError(f"{text[:50]!r} is no number from 1 to {most}")
    return int(text)


@contextmanager
def reading_of(args: argparse.Namespace) -> Iterator[Reading]:
    """What reads files, as the options say."""
    from silo.vault.index import Index, default_path
    from silo.vault.pool import pool_of
    from silo.vault.reading import Reading

    given = getattr(args, "index", None)
    path = None if getattr(args, "no_index", False) else given or default_path()
    count = getattr(args, "jobs", 1) or _processors()  # a command without the option reads one tree
    with Index(path, given=given is not None) as index, pool_of(count, getattr(args, "dask", None)) as pool:
        yield Reading(index, pool)


def _processors() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def client_of(
    args: argparse.Namespace,
    *,
    busy_tries: int | None = None,
    longest: float = 10.0,
    stop: threading.Event | None = None,
) -> Iterator[SiloClient]:
    """A client for the server that the options, the environment or the configuration name.

    busy_tries, longest
        for jobs that may wait: how often a server that puts us off is asked, and the longest pause (seconds).
    stop
        once it is set, nobody waits for the server any more.
    """
    from silo.api.caller import abilities_path
    from silo.api.client import SiloClient
    from silo.api.config import resolve_server
    from silo.api.policy import Retries
    from silo.api.transport import stop_if

    stopped = stop or threading.Event()

    def rest(seconds: float) -> None:
        stopped.wait(seconds)
        stop_if(stopped)

    where = resolve_server(getattr(args, "server", None), getattr(args, "token", None))
    retries = Retries(busy_tries=busy_tries, longest=longest, sleep=rest)
    memory = abilities_path()
    with SiloClient(where.url, where.token, verify=where.verify, memory=memory, retries=retries) as client:
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


def read_top(args: argparse.Namespace) -> Extraction:
    """The BOM of the file that the options name, from the index where it is known. Raises SiloError."""
    from silo.fcstd.suggest import with_suggestions
    from silo.vault.session import Question

    with reading_of(args) as reading:
        found = reading.ask(Question(args.top, args.assembly, not args.no_hardware, below=True)).found
    if isinstance(found, SiloError):
        raise found
    return with_suggestions(found)


@contextmanager
def plan_of(args: argparse.Namespace) -> Iterator[tuple[Plan, Reading, str]]:
    """All assemblies of the folder that the options name, and the folder. InputError where it has none."""
    from silo.files import documents_in
    from silo.vault.plan import make_plan

    refuse_assembly_of([args.top], args.assembly)
    base = os.path.realpath(args.top)
    tops = documents_in([args.top])
    if not tops:
        raise InputError(f"no FreeCAD files (*.FCStd) in {args.top}")
    with reading_of(args) as reading:
        reading.index.expect(base)
        plan = make_plan(tops, reading, hardware=not args.no_hardware)
        yield plan, reading, base


def refuse_assembly_of(tops: Sequence[str], assembly: str | None) -> None:
    """A name picks one of the assemblies of a file; the files of a folder have their own."""
    if assembly and any(os.path.isdir(top) for top in tops):
        raise InputError("--assembly picks an assembly of one file, and this is a folder; name the file")


def named_item(client: SiloClient, number: str) -> Item:
    """The item that a person named. InputError where there is none: it is the name that is wrong."""
    try:
        return client.get_item(number)
    except RouteMissingError:
        raise
    except NotFoundError:
        raise InputError(f"there is no item {number} on {client.base_url}") from None


def reach(client: SiloClient, extraction: Extraction | None = None) -> None:
    """Report a wrong address or token also where no component has an identity to ask the server about."""
    entries = () if extraction is None else walk_entries((extraction.assembly, *extraction.entries))
    if any(entry.silo_uuid for entry in entries):
        return
    with suppress(NotFoundError):  # a server that does not say who we are has answered all the same
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
