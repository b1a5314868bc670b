# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod``: the command line. Each command is parse → call → print.

Exit codes: 0 done · 1 differences or something left undone · 2 bad input · 3 the server or the way to it
· 130 cancelled.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version

from silo.bom.errors import CancelledError, ConflictError, RejectedError, RemoteError, SiloError

OK, UNDONE, BAD_INPUT, REMOTE, CANCELLED = 0, 1, 2, 3, 130

_COMMANDS = (
    "bom",
    "diff",
    "sync",
    "register",
    "serve",
    "watch",
    "inertia",
    "mass",
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
    args = build_parser().parse_args(argv)
    try:
        code: int = args.run(args)
        return code
    except KeyboardInterrupt:
        print("\nCancelled.", file=sys.stderr)
        return CANCELLED
    except BrokenPipeError:
        # The reader (head, less) has seen enough; that is no error. Nothing may be flushed any more.
        sys.stdout = None
        return OK
    except CancelledError:
        print("Cancelled.", file=sys.stderr)
        return CANCELLED
    except SiloError as error:
        _tell(error)
        return REMOTE if isinstance(error, RemoteError | ConflictError) else BAD_INPUT


def _tell(error: SiloError) -> None:
    print(f"silo-mod: {error}", file=sys.stderr)
    for problem in error.problems if isinstance(error, RejectedError) else ():
        print(f"  - {problem}", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
