# SPDX-License-Identifier: LGPL-2.1-or-later
"""A server in a process of its own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Self

TIMEOUT = 60


class ServerProcess:
    """A server in a process of its own, which can be killed at any moment; a context manager.

    ``settings`` are ``SILO_…`` variables.
    """

    def __init__(
        self, database_url: str, files_dir: Path, token: str, *, workers: int = 1, **settings: str
    ) -> None:
        environ = {**os.environ, "SILO_API_TOKEN": token, "SILO_STORAGE_ROOT_DIR": str(files_dir), **settings}
        command = [sys.executable, "-P", "-m", "silo_server", "--port", "0", "--database", database_url]
        self._process = subprocess.Popen(
            [*command, "--workers", str(workers)], env=environ, stdout=subprocess.PIPE, text=True
        )
        assert self._process.stdout is not None
        first = self._process.stdout.readline()
        assert first.startswith("Silo server: "), f"the server did not start: {first!r}"
        self.base_url = first.removeprefix("Silo server: ").strip()

    @property
    def pid(self) -> int:
        """Its process id."""
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
        if self._process.poll() is None:
            self._process.send_signal(by)
        return self._end()

    def _end(self) -> int:
        code = self._process.wait(TIMEOUT)
        assert self._process.stdout is not None
        self._process.stdout.close()
        return code
