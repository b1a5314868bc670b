# SPDX-License-Identifier: LGPL-2.1-or-later
"""The options that several commands have, and the rules between options.

:func:`shared_options` names for each option its commands. An option that would do nothing is refused
(:func:`only_with`, :func:`not_with`).
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from silo.bom.errors import InputError
from silo.bom.message import message

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
    "bom diff register commit status sync queue pull search show order import log watch whoami doctor inertia"
    " mass"
)


def shared_options() -> Iterator[SharedOption]:
    """Yield the options that several commands have, in the order of their help."""
    text = message("the assembly to read, where a file holds several")
    yield SharedOption("diff register mass", "--assembly", {"metavar": "NAME", "help": text})
    text += message("; {each} for each of them", each=repr(EACH))
    yield SharedOption("bom sync", "--assembly", {"metavar": "NAME", "help": text})
    servers = "serve backup restore summaries"
    every = f"{_ASK} where-used relink bom-diff {servers} login logout install-addon schema links"
    open_there = message("also files that a running FreeCAD has open; saving them there undoes this")
    for commands, option, text in (
        ("diff sync", "--recursive", message("the sub-assemblies too, children before parents")),
        ("diff bom-diff", "--check", message("exit 1 where anything differs, for CI")),
        (
            "bom diff commit sync",
            "--allow-missing",
            message("go on although linked files are missing; their known lines in Silo stay as they are"),
        ),
        ("sync relink", "--dry-run", message("show what would change, and change nothing")),
        ("register relink pull", "--even-if-open", open_there),
        (
            "bom diff register mass sync",
            "--no-hardware",
            message("leave out standard parts (screws, nuts, washers, inserts)"),
        ),
        (every, "--json", message("print JSON for machines")),
    ):
        yield SharedOption(commands, option, {"action": "store_true", "help": text})
    for commands, forms in (
        ("sync", ".html .md .json .xml"),
        ("inertia mass", ".html .json .csv .md"),
        ("bom-diff", ".md .json"),
    ):
        text = message(
            "write a report, by its suffix ({forms}); may be repeated", forms=forms.replace(" ", ", ")
        )
        how = {"metavar": "FILE", "action": "append", "default": [], "type": _report_in(forms), "help": text}
        yield SharedOption(commands, "--report", how)
    for commands, option, value, default, text in (
        (
            "commit status",
            "--root",
            "FOLDER",
            None,
            message("the project's folder, which is remembered (else found above TOP)"),
        ),
        ("where-used", "--root", "FOLDER", ".", message("the folder whose files are read (else this one)")),
        ("pull queue", "--into", "FOLDER", ".", message("the folder to write to (else this one)")),
        (
            "inertia mass",
            "--item",
            "PART_NUMBER",
            None,
            message("with --push: the item of the whole assembly"),
        ),
        ("watch", "--item", "PART_NUMBER", None, message("only events of this item")),
        (
            "register doctor",
            "--schema",
            "NAME",
            "kindred-rd",
            message("part number schema (else the server's only one)"),
        ),
    ):
        yield SharedOption(commands, option, {"metavar": value, "default": default, "help": text})
    limit = {
        "metavar": "N",
        "type": above_zero,
        "default": 20,
        "help": message("at most N, the newest first (20)"),
    }
    yield SharedOption("search log", "--limit", limit)
    text = message("where to remember what files hold (else your cache)")
    index = {"metavar": "FILE", "type": a_path, "help": text}
    yield SharedOption(f"{_READ} mass", "--index", index, "reading/index")
    text = message("read every file afresh, and remember nothing")
    how = {"action": "store_true", "help": text}
    yield SharedOption(f"{_READ} inertia mass links", "--no-cache", how, "reading/index")
    text = message("processes that read (default: the processors)")
    yield SharedOption(_READ, "--jobs", {"metavar": "N", "type": job_count, "help": text}, "reading")
    text = message("read on a Dask cluster that sees the same files (extra: dask)")
    yield SharedOption(_READ, "--dask", {"metavar": "ADDRESS", "help": text}, "reading")
    text = message("address of the Silo server (else SILO_API_URL)")
    yield SharedOption(_ASK, "--server", {"metavar": "URL", "help": text}, "server")
    text = message("API token (else SILO_API_TOKEN, which other users cannot read)")
    yield SharedOption(_ASK, "--token", {"help": text}, "server")


def _report_in(forms: str) -> Callable[[str], str]:
    def checked(text: str) -> str:
        if os.path.splitext(text)[1].lower() not in forms.split():
            raise InputError(
                message("--report writes {forms}; got {text}", forms=", ".join(forms.split()), text=text)
            )
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
    text = message(
        "the assembly's file, or a folder: all assemblies below it; several are read one after the other"
    )
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


def add_old_name(parser: argparse.ArgumentParser, old: str, option: str) -> None:
    """Accept the name that an option had before, for one release; it warns."""
    action = parser._option_string_actions[option]
    how: dict[str, Any] = {"nargs": action.nargs, "type": action.type, "choices": action.choices}
    parser.add_argument(
        old,
        dest=action.dest,
        action=_OldName,
        option=option,
        help=argparse.SUPPRESS,
        default=action.default,
        **how,
    )


class _OldName(argparse.Action):
    """Sets what the option of today sets, and warns."""

    def __init__(self, *names: Any, option: str, **how: Any) -> None:
        super().__init__(*names, **how)
        self.option = option

    def __call__(
        self, _parser: object, args: argparse.Namespace, value: Any, name: str | None = None
    ) -> None:
        text = message(
            "{old} is called {new} now; the old name goes with the next release", old=name, new=self.option
        )
        print(message("silo-mod: {text}", text=text), file=sys.stderr)
        setattr(args, self.dest, True if self.nargs == 0 else value)


def only_with(parser: argparse.ArgumentParser, needed: str, *options: str) -> None:
    """Refuse ``options`` without the option ``needed``, since a user expects that an option does something.

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
            raise InputError(
                message(
                    "{option} is for one file or item, and {count} are named",
                    option=option,
                    count=len(several),
                )
            )
    for option, needed in getattr(args, "needs", ()):
        if given(option) and not any(map(given, needed.split())):
            raise InputError(
                message(
                    "{option} does nothing without {needed}",
                    option=option,
                    needed=" or ".join(needed.split()),
                )
            )
    for option, other in getattr(args, "excludes", ()):
        if given(option) and given(other):
            raise InputError(
                message(
                    "{option} does nothing with {other}; leave one of them out", option=option, other=other
                )
            )


def a_path(text: str) -> Path:
    """Read an argument that is a path. Refuses an empty one, which would be the current folder."""
    if not text:
        raise InputError(message("the name of a file or folder is empty ('')"))
    return Path(text)


def job_count(text: str) -> int:
    """Read a number of processes from an argument."""
    return above_zero(text, most=512)


def above_zero(text: str, most: int = 1_000_000_000) -> int:
    """Read a count from an argument: a whole number above 0."""
    if not text.isascii() or not text.isdigit() or not 1 <= int(text[:20]) <= most:
        raise argparse.ArgumentTypeError(
            message("{text} is no number from 1 to {most}", text=repr(text[:50]), most=most)
        )
    return int(text)
