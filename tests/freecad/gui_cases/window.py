# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs a script inside FreeCAD with a window (Xvfb): the add-on in ``Mod``, and a real server."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from freecad_cases import machines
from freecad_cases.machines import REPOSITORY, FreeCAD
from server_testing import reserved_port

from silo.api.client import SiloClient
from silo_server.run import running_server
from silo_server.settings import Settings

TOKEN = "silo_" + "0123456789abcdef" * 2
TIMEOUT_S = 590
SCRIPTS = Path(__file__).parent

# No start page (it needs a browser engine) and no notification area (FreeCAD 1.0 deadlocks in it without a
# screen); facts §6.5.
_SEED = """<?xml version="1.0" encoding="UTF-8" standalone="no" ?>
<FCParameters><FCParamGroup Name="Root"><FCParamGroup Name="BaseApp"><FCParamGroup Name="Preferences">
 <FCParamGroup Name="General"><FCText Name="AutoloadModule">NoneWorkbench</FCText></FCParamGroup>
 <FCParamGroup Name="NotificationArea"><FCBool Name="NotificationAreaEnabled" Value="0"/></FCParamGroup>
 <FCParamGroup Name="Mod"></FCParamGroup>
</FCParamGroup></FCParamGroup></FCParamGroup></FCParameters>
"""


class Server:
    """An embedded server that can go away and come back at the same address, with the same data."""

    def __init__(self, folder: Path, port: int) -> None:
        self._database, self._port = f"sqlite:///{folder / 'silo.db'}", port
        self._stack = ExitStack()
        self.url = ""
        self.freecad_version = ""

    def up(self) -> None:
        settings = Settings(database_url=self._database, freecad_version=self.freecad_version)
        running = running_server(self._database, token=TOKEN, port=self._port, settings=settings)
        self.url = self._stack.enter_context(running).base_url

    def down(self) -> None:
        self._stack.close()

    @contextmanager
    def client(self) -> Iterator[SiloClient]:
        with SiloClient(self.url, TOKEN) as client:
            yield client


@dataclass
class Window:
    """One FreeCAD's home, kept over several runs, with the server that it talks to.

    answers
        name → function: what the script inside may ask of the test (``inside.ask``).
    """

    freecad: FreeCAD
    folder: Path
    server: Server
    answers: dict[str, Callable[[], Any]] = field(default_factory=dict)
    pixels: str = "1600x1000"

    @property
    def vault(self) -> Path:
        """Where the documents are."""
        return self.folder / "vault"

    @property
    def home(self) -> Path:
        return self.folder / "home"

    def prepare(self, *, dependencies: bool = True) -> None:
        """A fresh profile with the add-on in ``Mod``."""
        self.freecad.profile(self.home, dependencies=dependencies)
        (self.home / "user.cfg").write_text(_SEED)
        (self.home / "Mod").mkdir()
        (self.home / "Mod" / "silo-mod").symlink_to(REPOSITORY, target_is_directory=True)
        self.vault.mkdir()
        (self.folder / "asked").mkdir()

    @property
    def packages(self) -> Path:
        """Where this FreeCAD looks for additional Python packages."""
        base = self.home / "AdditionalPythonPackages"
        return base if self.freecad.version < (1, 0) else base / f"py{self.freecad.python.replace('.', '')}"

    def environment(self) -> dict[str, str]:
        """Everything of the user's is in the test's folder."""
        return {
            "FREECAD_USER_HOME": str(self.home),
            # Qt and Mesa map their shader caches into memory; FreeCADs that run at once must not share them.
            "XDG_CACHE_HOME": str(self.folder / "cache"),
            "XDG_DATA_HOME": str(self.folder / "data"),
            "XDG_CONFIG_HOME": str(self.folder / "config"),
            "XDG_RUNTIME_DIR": str(self.folder / "runtime"),
            "SILO_API_URL": self.server.url,
            "SILO_API_TOKEN": TOKEN,
            "SILO_TEST_FOLDER": str(self.folder),
            "SILO_TEST_CASES": str(SCRIPTS),
        }

    def run(self, script: str, *, env: Mapping[str, str] | None = None, code: int = 0) -> dict[str, Any]:
        """Run a script; gives what it wrote by ``inside.tell``.

        code
            how FreeCAD is to end; -9 where the script kills it.
        """
        (self.folder / "runtime").mkdir(mode=0o700, exist_ok=True)
        told = self.folder / "told.json"
        told.unlink(missing_ok=True)
        log = self.folder / "freecad.log"
        with log.open("wb") as output, _display(self.pixels) as display, self._answering():
            process = subprocess.Popen(
                [self.freecad.sibling("freecad"), "-P", str(SCRIPTS), str(SCRIPTS / script)],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                cwd=self.folder,
                env={**os.environ, **self.environment(), "DISPLAY": display, **(env or {})},
                start_new_session=True,
            )
            try:
                ended = process.wait(TIMEOUT_S)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                raise AssertionError(f"FreeCAD did not end\n{self._report(log)}") from None
        # The shell that entered a root ends with 137 where FreeCAD was killed.
        wanted = {code, 128 - code if code < 0 else code}
        assert ended in wanted, f"FreeCAD ended with {ended}\n{self._report(log)}"
        found = json.loads(told.read_text()) if told.exists() else {}
        assert isinstance(found, dict)
        return found

    def _report(self, log: Path) -> str:
        trace = self.folder / "trace.txt"
        return (trace.read_text() if trace.exists() else "") + log.read_text(errors="replace")[-3000:]

    @contextmanager
    def _answering(self) -> Iterator[None]:
        """Do what the script inside asks for, while it runs."""
        over = threading.Event()
        thread = threading.Thread(target=self._answer, args=(over,))
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()

    def _answer(self, over: threading.Event) -> None:
        folder = self.folder / "asked"
        while not over.wait(0.05):
            for question in folder.glob("*.question"):
                name = question.read_text()
                question.unlink()
                result = self.answers[name]()
                part = question.with_suffix(".part")
                part.write_text(json.dumps(result))
                part.rename(question.with_suffix(".answer"))


@contextmanager
def _display(pixels: str) -> Iterator[str]:
    """A screen of its own. Xvfb finds a free number itself, so several can start at once."""
    # "xvfb-run" would cover the exit code of FreeCAD with its own where its clean-up fails.
    read, write = os.pipe()
    # Without "-noreset" the end of the first of two programs would be the end of the other's connection.
    options = ["-displayfd", str(write), "-screen", "0", f"{pixels}x24", "-nolisten", "tcp", "-noreset"]
    server = subprocess.Popen(["Xvfb", *options], pass_fds=[write], stdin=subprocess.DEVNULL)
    os.close(write)
    try:
        with open(read, encoding="ascii") as answer:
            number = answer.readline().strip()
        assert number, "Xvfb did not start"
        yield f":{number}"
    finally:
        server.terminate()
        server.wait()


@contextmanager
def window(version: str, folder: Path, *, dependencies: bool = True) -> Iterator[Window]:
    """A FreeCAD of this version with a running server; skips loudly where the machine has none.

    dependencies
        with the Python packages that the add-on needs.
    """
    freecad = machines.need(version)
    if shutil.which("Xvfb") is None:
        machines.miss("Xvfb is not installed")
    folder = folder.resolve()
    with reserved_port() as port:
        server = Server(folder, port)
        made = Window(freecad, folder, server, {"server down": server.down, "server up": server.up})
        made.prepare(dependencies=dependencies)
        server.up()
        try:
            yield made
        finally:
            server.down()
