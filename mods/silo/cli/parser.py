# SPDX-License-Identifier: LGPL-2.1-or-later
"""The parser of the command line, and its help: in the user's language, the commands by theme."""

from __future__ import annotations

import argparse
import importlib
import re
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from silo import spoken
from silo.bom.errors import InputError, did_you_mean
from silo.bom.message import Message, message, template
from silo.cli.command_table import THEMES

_EPILOG = message(
    "exit codes: 0 done, 1 differences or something left undone, 2 bad input, 3 "
    "server, 130 cancelled\n\nThe server and the token come from --server and --token, "
    "else from SILO_API_URL and SILO_API_TOKEN, else from the configuration file. "
    "`silo-mod serve` starts a server of your own; `silo-mod demo` shows it all at "
    "once."
)


# What argparse says of bad arguments, in words that it makes itself.
_ARGPARSE = (
    template("the following arguments are required: {arguments}"),
    template("unrecognized arguments: {arguments}"),
    template("argument {argument}: invalid choice: {choice} (choose from {choices})"),
    template("argument {argument}: invalid {type} value: {value}"),
    template("argument {argument}: expected one argument"),
    template("argument {argument}: expected at least one argument"),
    template("argument {argument}: not allowed with argument {other}"),
    template("one of the arguments {arguments} is required"),
    template("argument {argument}: {problem}"),
)


def _said_by_argparse(sentence: str) -> str:
    """Make a message of a sentence of argparse."""
    if isinstance(sentence, Message):
        return sentence
    for text in _ARGPARSE:
        if (values := _values(text, sentence)) is not None:
            return Message(text, values)
    return sentence


def _values(text: str, sentence: str) -> dict[str, str] | None:
    """Return what stands in each place of a template, the shortest values first; None if the sentence is not
    made of the template. The time is linear, for the words of a command line may be anything.
    """
    first, *rest = re.split(r"\{(\w+)\}", text)
    if not sentence.startswith(first):
        return None
    values, start = {}, len(first)
    for name, behind in zip(rest[::2], rest[1::2], strict=True):
        is_last = name == rest[-2]
        end = len(sentence) - len(behind) if is_last else sentence.find(behind, start + 1)
        if end <= start or not sentence.startswith(behind, end):
            return None
        values[name] = sentence[start:end]
        start = end + len(behind)
    return values if start == len(sentence) else None


class _Help(argparse.RawDescriptionHelpFormatter):
    """In the language of the person; lines are folded, but for examples."""

    def add_usage(self, usage: str | None, actions: Any, groups: Any, prefix: str | None = None) -> None:
        super().add_usage(usage, actions, groups, spoken("usage: ") if prefix is None else prefix)

    def start_section(self, heading: str | None) -> None:
        super().start_section(spoken(heading or ""))

    def _get_help_string(self, action: argparse.Action) -> str:
        return spoken(action.help or "")

    def _fill_text(self, text: str, width: int, _indent: str) -> str:
        import textwrap

        return "\n".join(
            line
            if line.startswith("  silo-mod")
            else textwrap.fill(line, width, subsequent_indent=" " * 17 * line.startswith(" "))
            for line in text.splitlines()
        )


class _Parser(argparse.ArgumentParser):
    """Names the command or option that was probably meant, and lists commands by theme."""

    def error(self, message: str) -> NoReturn:
        words = self._known_words()
        given = re.search(r"(?:invalid choice: '|unrecognized arguments: )([^' =]+)", message)
        self.print_usage(sys.stderr)
        raise InputError(_said_by_argparse(message) + (did_you_mean(given[1], words) if given else ""))

    def format_help(self) -> str:
        for action in self._actions:
            if isinstance(action, argparse._SubParsersAction):
                action.help = argparse.SUPPRESS  # the end of the help has them, by theme
        return super().format_help()

    def _known_words(self) -> set[str]:
        if self._subparsers is None:
            return {str(choice) for action in self._actions for choice in action.choices or ()}
        commands = command_parsers(self)
        options = (parser._option_string_actions for parser in commands.values())
        return set(commands).union(*options)


def build_parser(words: Sequence[str] | None = None) -> argparse.ArgumentParser:
    """Build the parser of the whole command line; if ``words`` are given, only with the command that they
    choose.
    """
    parser = _Parser(
        prog="silo-mod",
        usage="silo-mod [-h] [--version] COMMAND ...",
        description=spoken(
            "The BOM of FreeCAD assemblies in Silo: read, compare, sync, register; mass and inertia."
        ),
        formatter_class=_Help,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    commands = parser.add_subparsers(prog="silo-mod", dest="command", metavar="COMMAND", title="commands")
    chosen = None if words is None else next((word for word in words if not word.startswith("-")), "")
    lines = []
    for theme, names in THEMES.items():
        lines.append(f"\n{spoken(theme)}:")
        for name, (module, text, example) in names.items():
            help_text = spoken(text)
            lines.append(message("  {name} {help_text}", name=f"{name:<14}", help_text=help_text))
            one = commands.add_parser(
                name,
                help=help_text,
                description=help_text[0].upper() + help_text[1:] + ".",
                epilog=f"{spoken('example:')}\n  {example}",
                formatter_class=_Help,
                allow_abbrev=False,  # --all is no --allow-missing
            )
            if chosen in (None, name):
                from silo.cli.options import add_shared
                from silo.cli.outputs import declare_shared_outputs

                there, word = importlib.import_module(f"silo.cli.{module}"), name.replace("-", "_")
                if add := getattr(there, f"add_{word}", None):  # options of its own
                    add(one)
                add_shared(one, name)
                declare_shared_outputs(one, name)
                one.set_defaults(run=getattr(there, f"run_{word}"), parser=one)
    parser.epilog = "\n".join([*lines, "", spoken(_EPILOG)])
    return parser


def command_parsers(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Return the parser of each command."""
    (commands,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    return dict(commands.choices)


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from importlib.metadata import PackageNotFoundError, version

        try:
            print(f"silo-mod {version('silo-mod')}")
        except PackageNotFoundError:
            print(message("silo-mod (not installed)"))  # run from a checkout
        parser.exit()
