# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod``: the command line. Each command is parse → call → print.

Exit codes: :class:`silo.bom.errors.Exit`.
"""

from __future__ import annotations

import argparse
import importlib
import io
import os
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from typing import TextIO, TypeVar

from silo.bom.errors import CancelledError, Exit, InputError, SiloError, exit_of
from silo.cli.common import refuse_idle_options

T = TypeVar("T")

_MODULES = (
    "bom",
    "diff",
    "sync",
    "register",
    "pull",
    "server",
    "setup",
    "inertia",
    "demo",
)

_EPILOG = """exit codes: 0 done, 1 differences or something left undone, 2 bad input, 3 server, 130 cancelled

The server and the token come from --server and --token, else from SILO_API_URL and SILO_API_TOKEN, else from
the configuration file. `silo-mod serve` starts a server of your own; `silo-mod demo` shows it all at once."""


def build_parser() -> argparse.ArgumentParser:
    """The whole command line."""
    parser = argparse.ArgumentParser(
        prog="silo-mod",
        description="The BOM of FreeCAD assemblies in Silo: read, compare, sync, register; mass and inertia.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"silo-mod {_version()}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name in _MODULES:
        importlib.import_module(f"silo.cli.{name}").register(commands)
    for one in commands.choices.values():
        one.set_defaults(parser=one)
    return parser


def _version() -> str:
    try:
        return version("silo-mod")
    except PackageNotFoundError:  # run from a checkout that is not installed
        return "(not installed)"


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit code."""
    _open_streams()
    if argv is None:  # a program of its own: a TERM signal ends it as Ctrl-C does, with its report
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    output, errors = sys.stdout, sys.stderr
    sys.stdout = kept = _Output(output)
    sys.stderr = told = _Output(errors)
    try:
        code = _run(argv)
        kept.flush()
    finally:
        sys.stdout, sys.stderr = output, errors
        for one in (kept, told):  # else each is when it is collected, and its stream may be closed by then
            with suppress(OSError, ValueError):
                one.close()
    if kept.failure is None or isinstance(kept.failure, BrokenPipeError):
        return code
    return max(code, _system_said_no(kept.failure))


def _run(argv: Sequence[str] | None) -> int:
    try:
        args = build_parser().parse_args(argv)
        if getattr(args, "ends_with_its_reader", False):
            sys.stdout.strict = True  # type: ignore[union-attr]
        _refuse_empty(args)
        refuse_idle_options(args.parser, args)
        code: int = args.run(args)
        return code
    except SystemExit as end:  # argparse: --help and --version are output like any other
        return end.code if isinstance(end.code, int) else Exit.BAD_INPUT
    except KeyboardInterrupt:
        print("\nCancelled.", file=sys.stderr)
        return Exit.CANCELLED
    except OSError as error:
        if isinstance(error, BrokenPipeError) and getattr(sys.stdout, "failure", None) is error:
            return Exit.DONE  # of a command that only ends with its reader
        return _system_said_no(error)
    except CancelledError:
        print("Cancelled.", file=sys.stderr)
        return Exit.CANCELLED
    except SiloError as error:
        _tell(error)
        return exit_of(error)


def _refuse_empty(args: argparse.Namespace) -> None:
    """A variable of a script that is not set must not mean the current folder."""
    for name, value in vars(args).items():
        empty = value == "" or (isinstance(value, list) and "" in value)
        if empty and name not in ("server", "token"):  # those have a sentence of their own
            raise InputError(f"the argument {name.upper()} is empty (''); leave it out, or give it a value")


def _open_streams() -> None:
    """Standard streams that take any text; a job may have been started without them."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        # What a terminal or a log cannot show (a C locale knows no ×) is shown as "?", never a failure.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


class _Output(io.TextIOBase):
    """A stream whose end does not end the work: what nobody can read any more is dropped, the rest is done.

    ``head`` closes its pipe after ten lines, a disk is full: a sync is finished all the same, and its report
    written. ``failure`` is what went wrong. ``strict``: raise it instead, for commands without an end.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.failure: OSError | None = None
        self.strict = False

    def write(self, text: str, /) -> int:
        return self._attempt(lambda: self._stream.write(text), len(text))

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
        """Python writes what is left at its end, which would fail again."""
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
        """That of the stream."""
        return getattr(self._stream, "encoding", None) or "utf-8"


def _system_said_no(error: OSError) -> int:
    """A file that we were asked to write, or the output itself: no such folder, no right, a full disk."""
    what = error.filename or "the output cannot be written"
    print(f"silo-mod: {what}: {error.strerror or error}", file=sys.stderr)
    return Exit.BAD_INPUT


def _tell(error: SiloError) -> None:
    print(f"silo-mod: {error}", file=sys.stderr)
    for problem in getattr(error, "problems", ()):
        print(f"  - {problem}", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
