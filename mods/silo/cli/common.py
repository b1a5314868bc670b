# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the commands share: options, opening files, reaching the server.

How results look on a terminal: a tree, tables, the Activity box. Text of others is shown as text.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from silo import spoken
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
from silo.platform import processors

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.policy import Retries
    from silo.api.wire import Item
    from silo.outbox.entry import Entry
    from silo.vault.plan import Plan
    from silo.vault.reading import VaultReader


READING = ("--index", "--no-cache", "--jobs", "--dask")


class SharedOption(NamedTuple):
    """An option that several commands have. ``group`` after a slash: options that exclude each other."""

    commands: str
    option: str
    how: dict[str, Any]
    group: str = ""


# For ``--assembly``: each of the assemblies of a file.
EACH = "all"
_READ = "bom diff register sync where-used"
_ASK = (
    "bom diff register commit status sync queue pull search show order log watch whoami doctor inertia mass"
)


def shared_options() -> Iterator[SharedOption]:
    """Yield the options that several commands have, in the order of their help."""
    text = "the assembly to read, where a file holds several"
    yield SharedOption("diff register mass", "--assembly", {"metavar": "NAME", "help": text})
    text += f"; {EACH!r} for each of them"
    yield SharedOption("bom sync", "--assembly", {"metavar": "NAME", "help": text})
    servers = "serve backup restore summaries"
    every = f"{_ASK} where-used relink bom-diff {servers} login logout install-addon schema links"
    open_there = "also files that a running FreeCAD has open; saving them there undoes this"
    for commands, option, text in (
        ("diff sync", "--recursive", "the sub-assemblies too, children before parents"),
        ("diff bom-diff", "--check", "exit 1 where anything differs, for CI"),
        (
            "bom diff commit sync",
            "--allow-missing",
            "go on although linked files are missing; their known lines in Silo stay as they are",
        ),
        ("sync relink", "--dry-run", "show what would change, and change nothing"),
        ("register relink pull", "--even-if-open", open_there),
        (
            "bom diff register mass sync",
            "--no-hardware",
            "leave out standard parts (screws, nuts, washers, inserts)",
        ),
        (every, "--json", "print JSON for machines"),
    ):
        yield SharedOption(commands, option, {"action": "store_true", "help": text})
    for commands, forms in (
        ("sync", ".html .md .json .xml"),
        ("inertia mass", ".html .json .csv .md"),
        ("bom-diff", ".md .json"),
    ):
        text = f"write a report, by its suffix ({forms.replace(' ', ', ')}); may be repeated"
        how = {"metavar": "FILE", "action": "append", "default": [], "type": _report_in(forms), "help": text}
        yield SharedOption(commands, "--report", how)
    for commands, option, value, default, text in (
        (
            "commit status",
            "--root",
            "FOLDER",
            None,
            "the project's folder, which is remembered (else found above TOP)",
        ),
        ("where-used", "--root", "FOLDER", ".", "the folder whose files are read (else this one)"),
        ("pull queue", "--into", "FOLDER", ".", "the folder to write to (else this one)"),
        ("inertia mass", "--item", "PART_NUMBER", None, "with --push: the item of the whole assembly"),
        ("watch", "--item", "PART_NUMBER", None, "only events of this item"),
        (
            "register doctor",
            "--schema",
            "NAME",
            "kindred-rd",
            "part number schema (else the server's only one)",
        ),
    ):
        yield SharedOption(commands, option, {"metavar": value, "default": default, "help": text})
    limit = {"metavar": "N", "type": above_zero, "default": 20, "help": "at most N, the newest first (20)"}
    yield SharedOption("search log", "--limit", limit)
    text = "where to remember what files hold (else your cache)"
    index = {"metavar": "FILE", "type": a_path, "help": text}
    yield SharedOption(f"{_READ} mass", "--index", index, "reading/index")
    text = "read every file afresh, and remember nothing"
    how = {"action": "store_true", "help": text}
    yield SharedOption(f"{_READ} inertia mass links", "--no-cache", how, "reading/index")
    text = "processes that read (default: the processors)"
    yield SharedOption(_READ, "--jobs", {"metavar": "N", "type": job_count, "help": text}, "reading")
    text = "read on a Dask cluster that sees the same files (extra: dask)"
    yield SharedOption(_READ, "--dask", {"metavar": "ADDRESS", "help": text}, "reading")
    text = "address of the Silo server (else SILO_API_URL)"
    yield SharedOption(_ASK, "--server", {"metavar": "URL", "help": text}, "server")
    text = "API token (else SILO_API_TOKEN, which other users cannot read)"
    yield SharedOption(_ASK, "--token", {"help": text}, "server")


def _report_in(forms: str) -> Callable[[str], str]:
    def checked(text: str) -> str:
        if os.path.splitext(text)[1].lower() not in forms.split():
            raise InputError(f"--report writes {', '.join(forms.split())}; got {text}")
        return text

    return checked


def add_shared(parser: argparse.ArgumentParser, command: str) -> None:
    """Add to a command the options that it shares with others."""
    groups: dict[str, Any] = {"": parser}
    for option in shared_options():
        if command in option.commands.split():
            title, _, exclusive = option.group.partition("/")
            group = groups.get(title) or groups.setdefault(title, parser.add_argument_group(title))
            if exclusive:
                group = groups.get(option.group) or groups.setdefault(
                    option.group, group.add_mutually_exclusive_group()
                )
            group.add_argument(option.option, **option.how)


def add_top(parser: argparse.ArgumentParser, *alone: str) -> None:
    """Add the assemblies' files or folders."""
    text = "the assembly's file, or a folder: all assemblies below it; several are read one after the other"
    add_each(parser, "top", *alone, metavar="TOP", help=text)


def add_each(parser: argparse.ArgumentParser, name: str, *alone: str, **how: Any) -> None:
    """Add the arguments that name what the command runs for, one after the other; ``alone``: options that
    need a single one.
    """
    parser.add_argument(name, nargs="+", **how)
    parser.set_defaults(each=name, alone=alone)


def add_options(parser: argparse._ActionsContainer, helps: Mapping[str, str]) -> None:
    """Add options: ``--flag``, ``--option VALUE``, or ``--option VALUE...`` for one that may be repeated."""
    for spec, text in helps.items():
        option, _, value = spec.partition(" ")
        how: dict[str, Any] = {"action": "store_true"}
        if value:
            how = {"metavar": value.removesuffix("...")}
            how |= {"action": "append", "default": []} if value.endswith("...") else {}
        parser.add_argument(option, help=text, **how)


def only_with(parser: argparse.ArgumentParser, needed: str, *options: str) -> None:
    """Refuse ``options`` without the option ``needed``, since a person expects that an option does something.

    ``needed`` may name several, such as "--apply --plan"; any of them is enough.
    """
    needs = parser.get_default("needs") or ()
    parser.set_defaults(needs=(*needs, *((option, needed) for option in options)))


def not_with(parser: argparse.ArgumentParser, other: str, *options: str) -> None:
    """Refuse ``options`` together with the option ``other``, with which they do nothing."""
    excludes = parser.get_default("excludes") or ()
    parser.set_defaults(excludes=(*excludes, *((option, other) for option in options)))


def refuse_idle_options(parser: argparse.ArgumentParser, args: argparse.Namespace) -> None:
    """Raise InputError for an option that would do nothing (:func:`only_with`, :func:`not_with`)."""

    def given(option: str) -> bool:
        name = next(action.dest for action in parser._actions if option in action.option_strings)
        return bool(getattr(args, name) != parser.get_default(name))

    if hasattr(args, "each") and len(several := getattr(args, args.each)) > 1:
        for option in filter(given, args.alone):
            raise InputError(f"{option} is for one file or item, and {len(several)} are named")
    for option, needed in getattr(args, "needs", ()):
        if given(option) and not any(map(given, needed.split())):
            raise InputError(f"{option} does nothing without {' or '.join(needed.split())}")
    for option, other in getattr(args, "excludes", ()):
        if given(option) and given(other):
            raise InputError(f"{option} does nothing with {other}; leave one of them out")


def a_path(text: str) -> Path:
    """Read an argument that is a path. Refuses an empty one, which would be the current folder."""
    if not text:
        raise InputError("the name of a file or folder is empty ('')")
    return Path(text)


def job_count(text: str) -> int:
    """Read a number of processes from an argument."""
    return above_zero(text, most=512)


def above_zero(text: str, most: int = 1_000_000_000) -> int:
    """Read a count from an argument: a whole number above 0."""
    if not text.isascii() or not text.isdigit() or not 1 <= int(text[:20]) <= most:
        raise argparse.ArgumentTypeError(f"{text[:50]!r} is no number from 1 to {most}")
    return int(text)


@contextmanager
def reading_of(args: argparse.Namespace) -> Iterator[VaultReader]:
    """Yield a reader of files with the options of the command."""
    from silo.vault.index import Index, default_path
    from silo.vault.reading import VaultReader, pool_of

    given = getattr(args, "index", None)
    path = None if getattr(args, "no_cache", False) else given or default_path()
    count = getattr(args, "jobs", 1) or processors()  # a command without the option reads one tree
    with Index(path, given=given is not None) as index, pool_of(count, getattr(args, "dask", None)) as pool:
        yield VaultReader(index, pool)


@contextmanager
def client_of(
    args: argparse.Namespace, retries: Retries | None = None, *, stop: threading.Event | None = None
) -> Iterator[SiloClient]:
    """Yield a client for the server that the options, the environment or the configuration name.

    retries
        how often and how soon a request is repeated, for a job that may wait.
    stop
        once it is set, nobody waits for the server any more.
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
            again = f"It is asked again in {duration(seconds)}; Ctrl-C ends this, what was sent stays"
            print(f"silo-mod: {error}. {again}", file=sys.stderr, flush=True)

    where = resolve_server(getattr(args, "server", None), getattr(args, "token", None))
    retries = replace(retries or Retries(), sleep=rest, tell=tell)
    memory = abilities_path()
    with SiloClient(where.url, where.token, verify=where.verify, memory=memory, retries=retries) as client:
        yield client


def read_assembly(top: str) -> Extraction:
    """Read the BOM of a file without FreeCAD, and suggest which files were meant by missing ones."""
    from silo.fcstd import Library

    with Library() as library:
        document = library.open(top)
        extraction = extract(choose_assembly(document))
        findings = respelt_findings(library.notes, document.FileName)
    return _with_suggestions(replace(extraction, findings=(*extraction.findings, *findings)))


def _with_suggestions(extraction: Extraction) -> Extraction:
    if not any(entry.missing for entry in walk_entries(extraction.entries)):
        return extraction
    from silo.fcstd.suggest import with_suggestions

    return with_suggestions(extraction)


def read_tops(args: argparse.Namespace) -> list[Extraction]:
    """Read the BOM of the file that the options name, or get it from the index. Raises SiloError.

    Reads each assembly of the file if all are asked for, else one.
    """
    from silo.vault.reading import Question

    names = [None if args.assembly == EACH else args.assembly]
    tops = []
    with reading_of(args) as reading:
        for name in names:
            error = reading.ask(Question(args.top, name, not args.no_hardware, below=True)).found
            if isinstance(error, SeveralAssembliesError) and args.assembly == EACH:
                names += error.names
            elif isinstance(error, SiloError):
                raise error
            else:
                tops.append(_with_suggestions(error))
    return tops


class ProgressPrinter:
    """Prints on standard error what a command does, after 5 seconds and then every 10.

    A thread prints it, so that a long step is reported too. An empty ``step`` is silence, for commands that
    wait for a person.
    """

    def __init__(self, command: str, clock: Callable[[], float] = time.monotonic) -> None:
        self.step = "working"
        self._command, self._clock, self._begun = command, clock, clock()
        self._due, self._ended = self._begun + 5, threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._ended.wait(0.2):
            self.report()

    def report(self) -> None:
        """Print the step if it is time."""
        now = self._clock()
        if now >= self._due:
            self._due = now + 10
            if self.step:
                from silo.cli.show import plain

                text = plain(f"silo-mod {self._command}: {spoken(self.step)}, {now - self._begun:.0f} s")
                print(text, file=sys.stderr, flush=True)


_running: list[ProgressPrinter] = []


@contextmanager
def progress_of(command: str) -> Iterator[None]:
    """Report the progress of a command until the block ends."""
    with ProgressPrinter(command) as progress:
        _running.append(progress)
        try:
            yield
        finally:
            _running.remove(progress)


def set_step(step: str) -> None:
    """Set the text for what the running command does now."""
    for progress in _running[-1:]:
        progress.step = step


def set_sending_step(entry: Entry, done: int, total: int) -> None:
    """Set that a file of the queue is being sent; both counts in bytes."""
    set_step(f"sending {entry.label or entry.file_name}, {done * 100 // max(total, 1)} %")


def count_steps(count: int) -> Callable[[str], None]:
    """Return a function that shows the next of ``count`` steps, by its name."""
    numbers = itertools.count(1)
    return lambda name: set_step(f"[{next(numbers)}/{count}] {name}")


@contextmanager
def plan_of(args: argparse.Namespace) -> Iterator[tuple[Plan, VaultReader, str]]:
    """Yield the plan of all assemblies in the folder that the options name, its reader, and the folder.
    InputError if there is none.
    """
    from silo.files import documents_in
    from silo.vault.plan import make_plan

    refuse_assembly_of([args.top], args.assembly)
    base = os.path.realpath(args.top)
    tops = documents_in([args.top])
    if not tops:
        raise InputError(f"no FreeCAD files (*.FCStd) in {args.top}")
    with reading_of(args) as reading:
        reading.index.expect(base)
        plan = make_plan(tops, reading, hardware=not args.no_hardware, progress=count_steps(len(tops)))
        yield plan, reading, base


def refuse_assembly_of(tops: Sequence[str], assembly: str | None) -> None:
    """Refuse --assembly for a folder: the name picks one of the assemblies of a file."""
    if assembly not in (None, EACH) and any(os.path.isdir(top) for top in tops):
        raise InputError("--assembly picks an assembly of one file, and this is a folder; name the file")


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
    """Get the item that a person named. InputError if there is none, since then the name is wrong."""
    try:
        return client.get_item(number)
    except RouteMissingError:
        raise
    except NotFoundError:
        raise InputError(f"there is no item {number} on {client.base_url}") from None


def reach(client: SiloClient, extraction: Extraction | None = None) -> None:
    """Report a wrong address or token even if no component has an identity about which to ask the server."""
    entries = () if extraction is None else walk_entries((extraction.assembly, *extraction.entries))
    if any(entry.silo_uuid for entry in entries):
        return
    with suppress(NotFoundError):  # a server that does not say who we are has answered anyway
        client.whoami()


def print_json(data: Any) -> None:
    """Print JSON on standard output; escaped if that is not UTF-8, or if a file's name is not."""
    print(json_text(data, indent=2))


def json_text(data: Any, indent: int | None = None) -> str:
    """Write JSON with characters that standard output can encode."""
    text = json.dumps(data, indent=indent, ensure_ascii=False)
    unicode = (getattr(sys.stdout, "encoding", None) or "utf-8").lower().replace("-", "") == "utf8"
    try:
        text.encode("utf-8" if unicode else "ascii")
    except UnicodeEncodeError:
        return json.dumps(data, indent=indent)
    return text
