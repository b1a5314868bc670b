# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod``: the command line. Each command is parse → call → print.

Exit codes: :class:`silo.bom.errors.Exit`.
"""

from __future__ import annotations

import argparse
import io
import json
import signal
import sys
from collections.abc import Sequence
from contextlib import nullcontext, redirect_stdout, suppress
from typing import Any

from silo import spoken
from silo.bom.errors import CancelledError, Exit, InputError, SiloError, exit_of
from silo.bom.message import beside, message
from silo.bom.system_refusals import why_refused
from silo.cli.parser import build_parser
from silo.cli.streams import OutputStream, open_streams


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit code."""
    open_streams()
    if argv is None:  # a program of its own: a TERM signal ends it as Ctrl-C does, with its report
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    output, errors = sys.stdout, sys.stderr
    sys.stdout = kept = OutputStream(output)
    sys.stderr = main_output = OutputStream(errors, spoken)
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
        from silo.cli.options import refuse_idle_options
        from silo.cli.outputs import refuse_bad_outputs
        from silo.cli.progress import progress_of

        refuse_idle_options(args.parser, args)
        refuse_bad_outputs(args.parser, args)
        with nullcontext() if hasattr(args, "waits") else progress_of(args.command):
            return _run_each(args)
    except SystemExit as end:  # argparse: --help and --version are output like any other
        return end.code if isinstance(end.code, int) else Exit.BAD_INPUT
    except EOFError:  # Ctrl-D, or the end of a pipe, where a question waits for an answer
        return _failed(InputError(message("no answer was given, and nothing was done")), words)
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
        from silo.cli.json_output import print_json_list

        print_json_list(printed)
    return max(codes)


def _as_json(error: SiloError) -> dict[str, Any]:
    problems = list(getattr(error, "problems", ()))
    text = str(error)
    return {"error": {"code": error.code, "message": text.strip(), **beside(text), "problems": problems}}


def _failed(error: SiloError, words: Sequence[str]) -> int:
    """Print an error as a sentence, and with --json as an object on standard output."""
    text = str(error)
    print(
        text if isinstance(error, CancelledError) else message("silo-mod: {text}", text=text), file=sys.stderr
    )
    for problem in getattr(error, "problems", ()):
        if problem in text:  # a server may say its single problem in the sentence too
            continue
        print(message("  - {problem}", problem=problem), file=sys.stderr)
    if "--json" in words and not getattr(sys.stdout, "begun", True):
        from silo.cli.json_output import print_json

        print_json(_as_json(error))
    return exit_of(error)


def _refuse_empty(args: argparse.Namespace) -> None:
    """Refuse empty arguments: an unset variable of a script must not mean the current folder."""
    for name, value in vars(args).items():
        empty = value == "" or (isinstance(value, list) and "" in value)
        if empty and name not in ("server", "token"):  # those have a sentence of their own
            raise InputError(
                message(
                    "the argument {name} is empty (''); leave it out, or give it a value", name=name.upper()
                )
            )


def _system_said_no(error: OSError) -> InputError:
    """Describe why a file or the output cannot be written: no such folder, no right, a full disk."""
    what = error.filename or message("the output cannot be written")
    return InputError(message("{what}: {error}", what=what, error=why_refused(error)))


if __name__ == "__main__":
    sys.exit(main())
