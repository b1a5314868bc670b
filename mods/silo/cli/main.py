# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod``: the command line. Each command is parse → call → print.

Exit codes: 0 done · 1 differences or something left undone · 2 bad input · 3 the server or the way to it
· 130 cancelled.
"""

from __future__ import annotations

import argparse
import importlib
import io
import os
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version

from silo.bom.errors import CancelledError, ConflictError, RejectedError, RemoteError, SiloError

OK, UNDONE, BAD_INPUT, REMOTE, CANCELLED = 0, 1, 2, 3, 130

_COMMANDS = (
    "bom",
    "diff",
    "bom_diff",
    "sync",
    "register",
    "pull",
    "relink",
    "serve",
    "backup",
    "watch",
    "doctor",
    "inertia",
    "links",
    "mass",
    "demo",
    "install_addon",
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
    )
    parser.add_argument("--version", action="version", version=f"silo-mod {_version()}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name in _COMMANDS:
        importlib.import_module(f"silo.cli.{name}").register(commands)
    return parser


def _version() -> str:
    try:
        return version("silo-mod")
    except PackageNotFoundError:  # run from a checkout that is not installed
        return "(not installed)"


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit code."""
    _open_streams()
    try:
        args = build_parser().parse_args(argv)
        code: int = args.run(args)
        sys.stdout.flush()
        return code
    except KeyboardInterrupt:
        print("\nCancelled.", file=sys.stderr)
        return CANCELLED
    except BrokenPipeError:
        # The reader (head, less) has seen enough; that is no error. Nothing may be flushed any more.
        _forget_output()
        return OK
    except OSError as error:
        return _system_said_no(error)
    except CancelledError:
        print("Cancelled.", file=sys.stderr)
        return CANCELLED
    except SiloError as error:
        _tell(error)
        return REMOTE if isinstance(error, RemoteError | ConflictError) else BAD_INPUT


def _open_streams() -> None:
    """Standard streams that take any text; a job may have been started without them."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        # What a terminal or a log cannot show (a C locale knows no ×) is shown as "?", never a failure.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _forget_output() -> None:
    """Python writes what is left at its end, which fails as what came before did."""
    sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115


def _system_said_no(error: OSError) -> int:
    """A file that we were told to write, or the output itself: no such folder, no right, a full disk."""
    what = error.filename or "the output cannot be written"
    print(f"silo-mod: {what}: {error.strerror or error}", file=sys.stderr)
    if error.filename is None:
        _forget_output()
    return BAD_INPUT


def _tell(error: SiloError) -> None:
    print(f"silo-mod: {error}", file=sys.stderr)
    for problem in error.problems if isinstance(error, RejectedError) else ():
        print(f"  - {problem}", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
