# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod``: the command line. Each command is parse → call → print.

Exit codes: :class:`silo.bom.errors.Exit`.
"""

from __future__ import annotations

import argparse
import importlib
import io
import json
import os
import re
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext, redirect_stdout, suppress
from typing import Any, NoReturn, TextIO, TypeVar

from silo import spoken
from silo.bom.errors import CancelledError, Exit, InputError, SiloError, did_you_mean, exit_of

T = TypeVar("T")

# By theme, each command's module, help and example. A module is imported if its command is chosen; `add_NAME`
# in it adds the command's own options, `run_NAME` runs it.
THEMES = {
    "Look at files": {
        "bom": (
            "bom",
            "show the BOM of a FreeCAD assembly, read from its files without FreeCAD",
            "silo-mod bom examples/gearbox/TopAssembly.FCStd --flat",
        ),
        "bom-diff": (
            "bom",
            "show what changed in parts between two folders, or two git revisions; needs no server",
            "silo-mod bom-diff --git main...HEAD",
        ),
        "where-used": (
            "bom",
            "show which files of a vault link to a file, and which tops a change of it touches",
            "silo-mod where-used vault/parts/Bracket.FCStd --root vault/",
        ),
        "diff": (
            "bom",
            "compare an assembly's BOM with the server's; changes nothing",
            "silo-mod diff TopAssembly.FCStd --check",
        ),
    },
    "Bring them to Silo": {
        "register": (
            "register",
            "create items for components without a part number and write their identity into the files",
            "silo-mod register vault/ --plan parts.csv      (edit the table, then)\n  "
            "silo-mod register vault/ --apply parts.csv",
        ),
        "commit": (
            "project",
            "send the files of a project and its BOMs: what differs from Silo, with all that it links to",
            'silo-mod commit TopAssembly.FCStd --comment "longer arm"',
        ),
        "status": (
            "project",
            "compare a project with Silo: edited here, newer there, both, not in Silo; changes nothing",
            "silo-mod status robot/",
        ),
        "sync": (
            "sync",
            "merge BOMs into the server; nothing is ever deleted, manual lines are never touched",
            "silo-mod sync vault/ --report night.md --report night.xml",
        ),
        "relink": (
            "bom",
            "let the links of an assembly and its sub-assemblies lead to a file that has moved",
            "silo-mod relink TopAssembly.FCStd --from parts/Bolt.FCStd --to hardware/Bolt.FCStd --dry-run",
        ),
    },
    "What is not in Silo yet": {
        "queue": (
            "sync",
            "list the commits that wait, send them again, save their files or discard them",
            "silo-mod queue retry",
        ),
    },
    "Look at Silo": {
        "search": (
            "show",
            "find items by words of their name or by part number",
            "silo-mod search base plate",
        ),
        "show": ("show", "show an item with its BOM lines", "silo-mod show A01-0001"),
        "order": (
            "show",
            "show what to order for so many pieces of a product, with prices, or write it as a table",
            "silo-mod order A01-0001 --quantity 50 --spares 5 --xlsx order.xlsx",
        ),
        "log": (
            "sync",
            "show the revisions of a file's item, and which one the file is; or what changed in a product",
            "silo-mod log TopAssembly.FCStd --changes",
        ),
        "watch": (
            "setup",
            "show the server's events as they happen (Ctrl-C ends)",
            "silo-mod watch --item A01-0001",
        ),
    },
    "Get files back": {
        "pull": (
            "sync",
            "fetch the file of an item with all that it links to; edited files stay as they are",
            "silo-mod pull A01-0001 --into robot",
        ),
    },
    "Mass and inertia": {
        "inertia": (
            "inertia",
            "mass, centre of mass and inertia of each link of a STEP assembly, with masses from a BOM",
            "silo-mod inertia arm.step --bom bom.csv --urdf arm.urdf --urdf-out robot.urdf",
        ),
        "mass": (
            "inertia",
            "mass, centre of mass and inertia of a FreeCAD assembly, from its parts' shapes and materials",
            "silo-mod mass TopAssembly.FCStd --push",
        ),
        "links": (
            "inertia",
            "a link map to start from: which part of an assembly belongs to which link of the robot",
            "silo-mod links examples/arm/arm.step --urdf examples/arm/arm.urdf > map.yaml",
        ),
    },
    "The connection": {
        "login": (
            "setup",
            "try a server's address and a token, and remember both for this user",
            "silo-mod login https://silo.example.com",
        ),
        "logout": ("show", "forget the server and the token that login remembered", "silo-mod logout"),
        "whoami": ("show", "show which server is meant, and as whom", "silo-mod whoami"),
        "doctor": (
            "setup",
            "show what is where on this machine, which server is meant, and what fails; changes nothing",
            "silo-mod doctor",
        ),
    },
    "A server": {
        "serve": (
            "setup",
            "run a Silo server here, on SQLite or PostgreSQL; prints its address and a token",
            "silo-mod serve --port 8080 --database postgresql://silo@localhost/silo",
        ),
        "backup": (
            "setup",
            "save a server's database and files to a new folder, while it serves",
            "silo-mod backup /backups/silo-2026-02-08 --database postgresql://silo@localhost/silo",
        ),
        "restore": (
            "setup",
            "bring a server's database and files back from a backup, to SQLite or PostgreSQL",
            "silo-mod restore /backups/silo-2026-02-08 --database sqlite:///silo.db",
        ),
        "summaries": (
            "setup",
            "sum all products of a server up again, while it serves",
            "silo-mod summaries --database postgresql://silo@localhost/silo",
        ),
        "demo": (
            "demo",
            "sync a real assembly with a temporary server and show what happens",
            "silo-mod demo --keep",
        ),
    },
    "FreeCAD and shell": {
        "install-addon": (
            "setup",
            "put the add-on and its Python packages into a FreeCAD found on this machine",
            "silo-mod install-addon --freecadcmd /usr/bin/freecadcmd",
        ),
        "completion": (
            "show",
            "print what completes commands and options in a shell",
            "silo-mod completion bash > ~/.local/share/bash-completion/completions/silo-mod",
        ),
        "schema": (
            "setup",
            "print the JSON Schema of what a command prints with --json",
            "silo-mod schema bom > bom.schema.json",
        ),
    },
}

_EPILOG = """exit codes: 0 done, 1 differences or something left undone, 2 bad input, 3 server, 130 cancelled

The server and the token come from --server and --token, else from SILO_API_URL and SILO_API_TOKEN, else \
from the configuration file. `silo-mod serve` starts a server of your own; `silo-mod demo` shows it all at \
once."""


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
        raise InputError(message + (did_you_mean(given[1], words) if given else ""))

    def format_help(self) -> str:
        for action in self._actions:
            if isinstance(action, argparse._SubParsersAction):
                action.help = argparse.SUPPRESS  # the end of the help has them, by theme
        return super().format_help()

    def _known_words(self) -> set[str]:
        if self._subparsers is None:
            return {str(choice) for action in self._actions for choice in action.choices or ()}
        (commands,) = (action for action in self._actions if isinstance(action, argparse._SubParsersAction))
        options = (parser._option_string_actions for parser in commands.choices.values())
        return set(commands.choices).union(*options)


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
            lines.append(f"  {name:<14} {help_text}")
            one = commands.add_parser(
                name,
                help=help_text,
                description=help_text[0].upper() + help_text[1:] + ".",
                epilog=f"{spoken('example:')}\n  {example}",
                formatter_class=_Help,
                allow_abbrev=False,  # --all is no --allow-missing
            )
            if chosen in (None, name):
                from silo.cli.common import add_shared

                there, word = importlib.import_module(f"silo.cli.{module}"), name.replace("-", "_")
                if add := getattr(there, f"add_{word}", None):  # options of its own
                    add(one)
                add_shared(one, name)
                one.set_defaults(run=getattr(there, f"run_{word}"), parser=one)
    parser.epilog = "\n".join([*lines, "", spoken(_EPILOG)])
    return parser


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from importlib.metadata import PackageNotFoundError, version

        try:
            print(f"silo-mod {version('silo-mod')}")
        except PackageNotFoundError:
            print("silo-mod (not installed)")  # run from a checkout
        parser.exit()


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit code."""
    _open_streams()
    if argv is None:  # a program of its own: a TERM signal ends it as Ctrl-C does, with its report
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    output, errors = sys.stdout, sys.stderr
    sys.stdout = kept = _Output(output)
    sys.stderr = main_output = _Output(errors, spoken)
    try:
        code = _run(argv)
        kept.flush()
    finally:
        sys.stdout, sys.stderr = output, errors
        for target in (
            kept,
            main_output,
        ):  # else each is when it is collected, and its stream may be closed by then
            with suppress(OSError, ValueError):
                target.close()
    if kept.failure is None or isinstance(kept.failure, BrokenPipeError):
        return code
    return max(code, _failed(_system_said_no(kept.failure), ()))


def _run(argv: Sequence[str] | None) -> int:
    args = argparse.Namespace()
    words = sys.argv[1:] if argv is None else argv
    try:
        parser = build_parser(words)
        args = parser.parse_args(words)
        if args.command is None:
            parser.print_help()
            return Exit.DONE
        if getattr(args, "ends_with_its_reader", False):
            sys.stdout.strict = True  # type: ignore[union-attr]
        _refuse_empty(args)
        from silo.cli.common import progress_of, refuse_idle_options

        refuse_idle_options(args.parser, args)
        with nullcontext() if hasattr(args, "waits") else progress_of(args.command):
            return _run_each(args)
    except SystemExit as end:  # argparse: --help and --version are output like any other
        return end.code if isinstance(end.code, int) else Exit.BAD_INPUT
    except KeyboardInterrupt:
        return _failed(CancelledError("\nCancelled."), words)
    except OSError as error:
        if isinstance(error, BrokenPipeError) and getattr(sys.stdout, "failure", None) is error:
            return Exit.DONE  # of a command that only ends with its reader
        return _failed(_system_said_no(error), words)
    except CancelledError:
        return _failed(CancelledError("Cancelled."), words)
    except SiloError as error:
        return _failed(error, words)


def _run_each(args: argparse.Namespace) -> int:
    """Run the command, once for each file or item that is named; return the worst exit code.

    For several, ``--json`` prints a list: what the command prints for each, or its error.
    """
    if not (name := getattr(args, "each", "")):
        return int(args.run(args))
    several = getattr(args, name)
    if len(several) == 1:
        setattr(args, name, several[0])
        return int(args.run(args))
    if name in ("top", "assembly"):
        from silo.files import must_exist

        must_exist(*several)
    codes, printed = [], []
    for path in several:
        output = io.StringIO() if args.json else sys.stdout
        try:
            with redirect_stdout(output):
                codes.append(int(args.run(argparse.Namespace(**{**vars(args), name: path}))))
            if isinstance(output, io.StringIO):
                printed.append(json.loads(output.getvalue()))
        except CancelledError:
            raise
        except SiloError as error:
            codes.append(_failed(error, ()))
            printed.append(_as_json(error))
    if args.json:
        from silo.cli.common import print_json

        print_json(printed)
    return max(codes)


def _as_json(error: SiloError) -> dict[str, Any]:
    problems = list(getattr(error, "problems", ()))
    return {"error": {"code": error.code, "message": str(error).strip(), "problems": problems}}


def _failed(error: SiloError, words: Sequence[str]) -> int:
    """Print an error as a sentence, and with --json as an object on standard output."""
    text = str(error)
    print(text if isinstance(error, CancelledError) else f"silo-mod: {text}", file=sys.stderr)
    for problem in getattr(error, "problems", ()):
        print(f"  - {problem}", file=sys.stderr)
    if "--json" in words and not getattr(sys.stdout, "begun", True):
        from silo.cli.common import print_json

        print_json(_as_json(error))
    return exit_of(error)


def _refuse_empty(args: argparse.Namespace) -> None:
    """Refuse empty arguments: an unset variable of a script must not mean the current folder."""
    for name, value in vars(args).items():
        empty = value == "" or (isinstance(value, list) and "" in value)
        if empty and name not in ("server", "token"):  # those have a sentence of their own
            raise InputError(f"the argument {name.upper()} is empty (''); leave it out, or give it a value")


def _open_streams() -> None:
    """Open standard streams that take any text; a job may have been started without them."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        # What a terminal or a log cannot show (a C locale knows no ×) is shown as "?", never a failure.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


class _Output(io.TextIOBase):
    """A stream whose end does not end the work: what nobody can read any more is dropped, the rest is done.

    ``head`` closes its pipe after ten lines, a disk is full: a sync is finished anyway, and its report
    written. ``failure`` is what went wrong. ``strict``: raise it instead, for commands without an end. What a
    person alone reads is ``translated``.
    """

    def __init__(self, stream: TextIO, translated: Callable[[str], str] = str) -> None:
        self._stream, self._translated = stream, translated
        self.failure: OSError | None = None
        self.strict = self.begun = False

    def write(self, text: str, /) -> int:
        self.begun = True
        shown = self._translated(text)
        return self._attempt(lambda: self._stream.write(shown), len(text))

    def flush(self) -> None:
        self._attempt(self._stream.flush, None)

    def _attempt(self, act: Callable[[], T], otherwise: T) -> T:
        if self.failure is None:
            try:
                return act()
            except OSError as error:
                self.failure = error
                self._forget()
        if self.strict:
            raise self.failure
        return otherwise

    def _forget(self) -> None:
        """Drop what is left in a stream, since Python would write it at the end and fail again."""
        with suppress(OSError, ValueError):
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, self._stream.fileno())
            os.close(null)

    def fileno(self) -> int:
        return self._stream.fileno()

    def isatty(self) -> bool:
        return self._stream.isatty()

    @property
    def encoding(self) -> str:  # type: ignore[override]
        return getattr(self._stream, "encoding", None) or "utf-8"


def _system_said_no(error: OSError) -> InputError:
    """Describe why a file or the output cannot be written: no such folder, no right, a full disk."""
    what = error.filename or "the output cannot be written"
    return InputError(f"{what}: {error.strerror or error}")


if __name__ == "__main__":
    sys.exit(main())
