# SPDX-License-Identifier: LGPL-2.1-or-later
"""A server in a process of its own; and processes forked from one that has loaded everything already."""

from __future__ import annotations

import multiprocessing
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerContext
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Self

from silo.platform.sockets import own_the_port

TIMEOUT = 300  # [s], reached only if the test fails; a busy machine may need minutes


class ServerProcess:
    """A server in a process of its own, which can be killed at any moment; a context manager.

    ``settings`` are ``SILO_…`` variables.
    """

    def __init__(
        self, database_url: str, files_dir: Path, token: str, *, workers: int = 1, **settings: str
    ) -> None:
        command = [
            sys.executable,
            "-P",
            "-m",
            "silo.cli.main",
            "serve",
            "--port",
            "0",
            "--database",
            database_url,
        ]
        process = subprocess.Popen(
            [*command, "--workers", str(workers)],
            env={**os.environ, **_environ(files_dir, token, settings)},
            stdout=subprocess.PIPE,
            text=True,
        )
        assert process.stdout is not None
        first = process.stdout.readline()
        assert first.startswith("Silo server: "), f"the server did not start: {first!r}"
        self._process: subprocess.Popen[str] | BaseProcess = process
        self.base_url = first.removeprefix("Silo server: ").strip()

    @classmethod
    def forked(
        cls, database_url: str, files_dir: Path, token: str, *, user_id: int | None = None, **settings: str
    ) -> Self:
        """One that starts in a tenth of the time, for tests that kill hundreds.

        It is forked from a process that has loaded the server and done nothing else. ``user_id``: serve as
        this user of the machine (needs root).
        """
        self = cls.__new__(cls)
        ours, theirs = _loaded().Pipe()
        self._process = forked(_serve, database_url, _environ(files_dir, token, settings), user_id, theirs)
        theirs.close()
        try:
            assert ours.poll(TIMEOUT), "the server did not start in time"
            said = ours.recv()
        except EOFError:
            said = "the server ended before it answered"
        finally:
            ours.close()
        if not said.startswith("http"):
            self._end()
            raise AssertionError(f"the server did not start: {said}")
        self.base_url = said
        return self

    @property
    def pid(self) -> int:
        """Its process id."""
        assert self._process.pid is not None
        return self._process.pid

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def kill(self) -> None:
        """``kill -9``, and wait until it is gone."""
        self._process.kill()
        self._end()

    def stop(self, by: signal.Signals = signal.SIGTERM) -> int:
        """Ask it to end (SIGINT is Ctrl-C), and wait; its exit code."""
        with suppress(ProcessLookupError):
            os.kill(self.pid, by)
        return self._end()

    def _end(self) -> int:
        if isinstance(self._process, BaseProcess):
            self._process.join(TIMEOUT)
            assert self._process.exitcode is not None, "the server does not end"
            return self._process.exitcode
        code = self._process.wait(TIMEOUT)
        assert self._process.stdout is not None
        self._process.stdout.close()
        return code


def _environ(files_dir: Path, token: str, settings: dict[str, str]) -> dict[str, str]:
    return {"SILO_API_TOKEN": token, "SILO_STORAGE_ROOT_DIR": str(files_dir), **settings}


@contextmanager
def reserved_port() -> Iterator[int]:
    """A port of this machine that nobody else is given meanwhile; a server that is told it may listen there.

    Nothing answers there until one does: a port that was merely free a moment ago may be anybody's by now.
    """
    with socket.socket() as held:
        own_the_port(held)
        held.bind(("127.0.0.1", 0))
        yield held.getsockname()[1]


def forked(work: Callable[..., None], *args: Any) -> BaseProcess:
    """``work(*args)`` in a process of its own, forked from the loaded one; it ends with this process."""
    process = _loaded().Process(target=work, args=args, daemon=True)
    process.start()
    return process


def command_line(args: Sequence[str]) -> None:
    """What ``silo-mod`` does with these arguments, without a word; for :func:`forked`."""
    from silo.cli.main import main

    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        sys.stdout = sys.stderr = nowhere
        sys.exit(main(args))


@cache
def _loaded() -> ForkServerContext:
    context = multiprocessing.get_context("forkserver")
    modules = [
        "psycopg",
        "silo.cli.main",
        "silo.cli.setup.server",
        "silo_server.backup",
        "silo_server.run",
    ]
    context.set_forkserver_preload(modules)
    return context


def _serve(database_url: str, environ: dict[str, str], user_id: int | None, said: Connection) -> None:
    from silo.bom.errors import SiloError
    from silo_server.run import serve

    os.environ.update(environ)
    if user_id is not None:
        os.setuid(user_id)
    try:
        serve(port=0, database_url=database_url, tell=lambda greeting: said.send(greeting.url))
    except SiloError as error:
        said.send(str(error))
