# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the commands share: options, opening files, reaching the server.

How results look on a terminal: a tree, tables, the Activity box. Text of others is shown as text.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from silo.bom.errors import (
    InputError,
    NotFoundError,
    RouteMissingError,
    SeveralAssembliesError,
    SiloError,
    duration,
)
from silo.bom.findings import respelt_findings
from silo.bom.links import extract
from silo.bom.model import Extraction, walk_entries
from silo.bom.roots import choose_assembly

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.wire import Item
    from silo.vault.plan import Plan
    from silo.vault.reading import Reading


READING = ("--index", "--no-index", "--jobs", "--dask")


class Shared(NamedTuple):
    """An option that several commands have. ``group`` after a slash: options that exclude each other."""

    commands: str
    option: str
    how: dict[str, Any]
    group: str = ""


# For ``--assembly``: each of the assemblies of a file.
EACH = "all"
_READ = "bom diff register sync where-used"
_ASK = "bom diff register commit status sync queue pull search show log watch whoami doctor inertia mass"


def shared_options() -> Iterator[Shared]:
    """Yield the options that several commands have, in the order of their help."""
    text = "the assembly to read, where a file holds several"
    yield Shared("diff register mass", "--assembly", {"metavar": "NAME", "help": text})
    text += f"; {EACH!r} for each of them"
    yield Shared("bom sync", "--assembly", {"metavar": "NAME", "help": text})
    servers = "serve backup restore summaries"
    every = f"{_ASK} where-used relink bom-diff {servers} login logout install-addon schema links"
    open_there = "also files that a running FreeCAD has open; whoever saves them there undoes this"
    for commands, option, text in (
        ("diff sync", "--recursive", "the sub-assemblies too, children before parents"),
        ("diff bom-diff", "--check", "exit 1 where anything differs, for CI"),
        ("sync relink", "--dry-run", "show what would change, and change nothing"),
        ("register relink pull", "--even-if-open", open_there),
        (
            "bom diff register mass sync",
            "--no-hardware",
            "leave out standard parts (screws, nuts, washers, inserts)",
        ),
        (every, "--json", "print JSON for machines"),
    ):
        yield Shared(commands, option, {"action": "store_true", "help": text})
    for commands, forms in (
        ("sync", ".html .md .json .xml"),
        ("inertia mass", ".json .csv .md"),
        ("bom-diff", ".md .json"),
    ):
        text = f"write a report, by its suffix ({forms.replace(' ', ', ')}); may be repeated"
        how = {"metavar": "FILE", "action": "append", "default": [], "type": _report_in(forms), "help": text}
        yield Shared(commands, "--report", how)
    text = "where to remember what files hold (else your cache)"
    index = {"metavar": "FILE", "type": a_path, "help": text}
    yield Shared(f"{_READ} mass", "--index", index, "reading/index")
    text = "read every file, and remember nothing"
    yield Shared(f"{_READ} mass", "--no-index", {"action": "store_true", "help": text}, "reading/index")
    text = "processes that read (default: the processors)"
    yield Shared(_READ, "--jobs", {"metavar": "N", "type": job_count, "help": text}, "reading")
    text = "read on a Dask cluster that sees the same files (extra: dask)"
    yield Shared(_READ, "--dask", {"metavar": "ADDRESS", "help": text}, "reading")
    text = "address of the Silo server (else SILO_API_URL)"
    yield Shared(_ASK, "--server", {"metavar": "URL", "help": text}, "server")
    text = "API token (else SILO_API_TOKEN, which other users cannot read)"
    yield Shared(_ASK, "--token", {"help": text}, "server")


def _report_in(forms: str) -> Callable[[str], str]:
    def checked(text: str) -> str:
        if os.path.splitext(text)[1].lower() not in forms.split():
            raise InputError(f"--report writes {', '.join(forms.split())}; got {text}")
        return text

    return checked


def add_shared(parser: argparse.ArgumentParser, command: str) -> None:
    """Give a command the options that it shares with others."""
    groups: dict[str, Any] = {"": parser}
    for one in shared_options():
        if command in one.commands.split():
            title, _, exclusive = one.group.partition("/")
            group = groups.get(title) or groups.setdefault(title, parser.add_argument_group(title))
            if exclusive:
                group = groups.get(one.group) or groups.setdefault(
                    one.group, group.add_mutually_exclusive_group()
                )
            group.add_argument(one.option, **one.how)


def add_top(parser: argparse.ArgumentParser) -> None:
    """Add the assembly's file, or a folder."""
    parser.add_argument(
        "top", metavar="TOP", help="the assembly's file, or a folder: all assemblies below it"
    )


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
    from silo.vault.reading import Reading, pool_of

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
    from silo.api.client import SiloClient
    from silo.api.config import resolve_server
    from silo.api.policy import Retries
    from silo.api.transport import abilities_path, stop_if

    stopped = stop or threading.Event()

    def rest(seconds: float) -> None:
        stopped.wait(seconds)
        stop_if(stopped)

    def tell(seconds: float, error: SiloError) -> None:
        if seconds > 5:
            again = f"It is asked again in {duration(seconds)}; Ctrl-C ends this, what was sent stays"
            print(f"silo-mod: {error}. {again}", file=sys.stderr, flush=True)

    where = resolve_server(getattr(args, "server", None), getattr(args, "token", None))
    retries = Retries(busy_tries=busy_tries, longest=longest, sleep=rest, tell=tell)
    memory = abilities_path()
    with SiloClient(where.url, where.token, verify=where.verify, memory=memory, retries=retries) as client:
        yield client


def read_assembly(top: str, assembly: str | None = None, *, hardware: bool = True) -> Extraction:
    """The BOM of a file, read without FreeCAD; missing files come with the ones that were probably meant."""
    from silo.fcstd import Library

    with Library() as library:
        document = library.open(top)
        found = extract(choose_assembly(document, assembly), hardware=hardware)
        told = respelt_findings(library.notes, document.FileName)
    return _with_suggestions(replace(found, findings=(*found.findings, *told)))


def _with_suggestions(found: Extraction) -> Extraction:
    if not any(entry.missing for entry in walk_entries(found.entries)):
        return found
    from silo.fcstd.linked import with_suggestions

    return with_suggestions(found)


def read_tops(args: argparse.Namespace) -> list[Extraction]:
    """The BOM of the file that the options name, from the index where it is known. Raises SiloError.

    Of each assembly of the file if all are asked for, else one.
    """
    from silo.vault.reading import Question

    names = [None if args.assembly == EACH else args.assembly]
    tops = []
    with reading_of(args) as reading:
        for name in names:
            found = reading.ask(Question(args.top, name, not args.no_hardware, below=True)).found
            if isinstance(found, SeveralAssembliesError) and args.assembly == EACH:
                names += found.names
            elif isinstance(found, SiloError):
                raise found
            else:
                tops.append(_with_suggestions(found))
    return tops


class Progress:
    """Prints on standard error how far a long run is: after 5 seconds, then every 10."""

    def __init__(self, count: int = 0, clock: Callable[[], float] = time.monotonic) -> None:
        self._count, self._number = count, 0
        self._clock, self._due = clock, clock() + 5

    def begin(self, top: str) -> None:
        """Begin with the next file."""
        self._number += 1
        self.tell(f"[{self._number}/{self._count}] {top}")

    def tell(self, text: str) -> None:
        """Print the text if it is time."""
        from silo.cli.show import plain

        if self._clock() >= self._due:
            self._due = self._clock() + 10
            print(plain(text), file=sys.stderr)


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
        plan = make_plan(tops, reading, hardware=not args.no_hardware, progress=Progress(len(tops)).begin)
        yield plan, reading, base


def refuse_assembly_of(tops: Sequence[str], assembly: str | None) -> None:
    """A name picks one of the assemblies of a file; the files of a folder have their own."""
    if assembly not in (None, EACH) and any(os.path.isdir(top) for top in tops):
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
