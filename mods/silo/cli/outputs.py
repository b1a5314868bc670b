# SPDX-License-Identifier: LGPL-2.1-or-later
"""The options that name a file to write: each is declared with the form of its file, and guarded first.

What the other arguments name is read by the run, and is never written over.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.cli.options import add_options
from silo.output_files import INDEX, REPORTS, Output, OutputForm, check_outputs, scene

# Of a path, since the ending of a report decides how it is written.
FormOf = Callable[[str], OutputForm]


def add_outputs(
    parser: argparse.ArgumentParser,
    helps: Mapping[str, str],
    form: OutputForm | FormOf,
    group: argparse._ActionsContainer | None = None,
) -> None:
    """Add options that name files to write: ``--option FILE``, or ``--option FILE...`` for several."""
    add_options(group or parser, helps)
    for spec in helps:
        declare_output(parser, spec.partition(" ")[0], form)


def declare_output(parser: argparse.ArgumentParser, option: str, form: OutputForm | FormOf) -> None:
    """Declare that an option names a file to write."""
    form_of: FormOf = (lambda _path, kept=form: kept) if isinstance(form, OutputForm) else form  # type: ignore[misc]
    parser.set_defaults(outputs=(*(parser.get_default("outputs") or ()), (option, form_of)))


def declare_shared_outputs(parser: argparse.ArgumentParser, command: str) -> None:
    """Declare the options for writing that several commands share."""
    if "--report" in parser._option_string_actions:
        kind = "mass" if command == "inertia" else command
        declare_output(parser, "--report", lambda path: REPORTS[kind][os.path.splitext(path)[1].lower()])
    if "--index" in parser._option_string_actions:
        declare_output(parser, "--index", INDEX)


def add_preview(
    parser: argparse.ArgumentParser, text: str, group: argparse._ActionsContainer | None = None
) -> None:
    """Add the option for 3D scenes, which end in ``.glb``."""
    add_outputs(parser, {"--preview FILE...": text}, scene(), group)


def refuse_bad_outputs(parser: argparse.ArgumentParser, args: argparse.Namespace) -> None:
    """Raise InputError for output files that would replace a model, an input, or a foreign file."""
    outputs = list(_outputs(parser, args))
    if outputs:
        written = {name for name, _ in _declared(parser)}
        check_outputs(outputs, [path for name, path in _paths(args) if name not in written])


def _declared(parser: argparse.ArgumentParser) -> Iterator[tuple[str, tuple[str, FormOf]]]:
    """Yield the name of the value of each option that writes, and its declaration."""
    for option, form_of in parser.get_default("outputs") or ():
        yield parser._option_string_actions[option].dest, (option, form_of)


def _outputs(parser: argparse.ArgumentParser, args: argparse.Namespace) -> Iterator[Output]:
    for name, (option, form_of) in _declared(parser):
        for path in _texts(getattr(args, name)):
            if path == "-":
                if option not in (parser.get_default("to_standard_output") or ()):
                    raise InputError(
                        message("{option} writes a file, and - is the standard output", option=option)
                    )
                continue
            yield Output(option, path, form_of(path))


def _paths(args: argparse.Namespace) -> Iterator[tuple[str, str]]:
    """Yield the name and the path of each argument that names a file which exists."""
    for name, value in vars(args).items():
        for text in _texts(value):
            if text and "\0" not in text and os.path.isfile(text):
                yield name, text


def _texts(value: Any) -> Iterator[str]:
    for one in value if isinstance(value, (list, tuple)) else (value,):
        if isinstance(one, (str, Path)):
            yield str(one)
