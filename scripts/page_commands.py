#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Run the commands of pages in their order, as a reader does: page_commands.py PAGE...

Each page begins in an empty folder that holds ``examples``, with an empty home and no server. The program is
the ``silo-mod`` beside this Python. Exit code 1 names the first command that did not do what its page says. A
page says in HTML comments what a reader does not need:

    <!-- before: COMMANDS -->   what others did before, or what the reader does in FreeCAD
    <!-- not run: REASON -->    the next block is left out; a path in the reason must exist
    <!-- browser: STEPS -->     what the reader does in the browser: open PATH, press NAME, fill LABEL: TEXT,
                                see TEXT, download NAME

The comment of a command may name its exit code ("exit code 1"). A block of ``text`` has lines that the
commands above it print; ``…`` stands for anything. ``silo-mod serve`` takes a free port, and ``watch`` is
ended when it has said something.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
ADDRESS = "127.0.0.1:8080"
CHROMIUM = os.environ.get("SILO_CHROMIUM", "/usr/bin/chromium")
_PART = re.compile(
    r"<!-- (before|not run|browser):\s*(.*?)\s*-->|^( *)```([a-z]*)\n(.*?)^ *```$", re.DOTALL | re.MULTILINE
)


@dataclass(frozen=True)
class Step:
    """A block of a page: what it is, its text, and why it is left out."""

    kind: str  # "before", "browser", "sh", "text", or another language
    text: str
    reason: str = ""

    def commands(self) -> list[str]:
        """Return the commands, each in one line."""
        lines = self.text.replace("\\\n", " ").splitlines()
        return [line.strip() for line in lines if line.strip() and not line.lstrip().startswith("#")]


def steps(page: str) -> Iterator[Step]:
    """Yield the blocks of a page, in order."""
    reason = ""
    for note, said, indent, language, text in _PART.findall(page):
        if note == "not run":
            reason = " ".join(said.split())
        elif note:
            yield Step(note, said)
        else:
            yield Step(language, textwrap.dedent(indent + text), reason)
            reason = ""


@dataclass
class Reader:
    """A person with a shell and a browser, in a folder of her own."""

    scratch: Path
    env: dict[str, str]
    greeting: dict[str, Any] = field(default_factory=dict)
    server: subprocess.Popen[str] | None = None
    browser: Any = None

    @property
    def place(self) -> str:
        """Host and port of the server that runs."""
        return str(self.greeting["url"]).partition("//")[2] if self.greeting else ADDRESS

    def follow(self, page: str) -> str:
        """Do what a page says; return what went wrong."""
        printed = ""
        for step in steps(page):
            if step.kind == "text" and not step.reason:
                for line in filter(None, map(plain, step.text.splitlines())):
                    if not re.search(re.escape(line).replace("…", ".*"), plain(printed)):
                        return f"The page says {line!r}. Printed was:\n{printed}"
            elif step.kind == "browser":
                self.browse(step.commands())
            elif step.kind in ("sh", "before") and not step.reason:
                printed = ""
                for command in step.commands():
                    code, text = self.run(command)
                    printed += text
                    wanted = re.search(r"#.*exit code (\d+)", command)
                    if code != int(wanted[1] if wanted else 0):
                        return f"{command}\nended with {code}:\n{text}"
            elif step.kind == "sh":
                print(*(f"not run: {one}" for one in step.commands()), f"  because: {step.reason}", sep="\n")
        return ""

    def run(self, command: str) -> tuple[int, str]:
        """Run a line in the shell; return its exit code and what it printed."""
        print(command, flush=True)
        line = command.replace(ADDRESS, self.place)
        state, words = self.scratch / "state", line.partition(" #")[0]
        begin = f". {state}; " if state.exists() else ""
        end = f"\ncode=$?; {{ declare -px; printf 'cd %q\\n' \"$PWD\"; }} > {state}; exit $code"
        shell = [shutil.which("bash") or "bash", "-c"]
        if line.startswith("silo-mod serve"):
            self.stop()
            streams = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "text": True}
            self.server = subprocess.Popen(
                [*shell, f"{begin} exec {words} --port 0 --json"], cwd=self.work, env=self.env, **streams
            )
            assert self.server.stdout is not None
            said = self.server.stdout.readline()
            self.greeting = json.loads(said) if said else {}
            return (0 if said else 1), said
        watching = line.startswith("silo-mod watch")
        run = subprocess.Popen(
            [*shell, f"{begin} exec {words}" if watching else f"{begin}{line}{end}"],
            cwd=self.work,
            env=self.env,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
        )
        assert run.stdout is not None
        first = run.stdout.readline() if watching else ""
        if watching:
            run.send_signal(signal.SIGTERM)
        # What a person types is the token; nothing else of these pages asks.
        typed = f"{self.greeting.get('token', '')}\n" if line.startswith("silo-mod login") else ""
        printed = first + run.communicate(typed, timeout=300)[0]
        if watching and run.returncode == 130:
            return 0, printed
        return run.returncode, printed.replace(self.place, ADDRESS)

    @property
    def work(self) -> Path:
        """The folder in which the page begins."""
        return self.scratch / "work"

    def browse(self, lines: list[str]) -> None:
        """Do what the reader does in the browser; raise where a page does not show it."""
        if self.browser is None:
            from playwright.sync_api import sync_playwright

            self.browser = sync_playwright().start()
            self.tab = self.browser.chromium.launch(
                executable_path=CHROMIUM, args=["--no-sandbox"]
            ).new_page()
            self.tab.set_default_timeout(20_000)
            self.tab.goto(self.greeting["login_url"])
            self.tab.locator("main form button").click()
            self.tab.wait_for_url(lambda url: "/login/" not in url)
        for line in lines:
            print("browser:", line, flush=True)
            verb, _, rest = line.partition(" ")
            wanted = re.compile(rf"^\s*{re.escape(rest)}\s*$")
            button, link = (self.tab.get_by_role(role, name=wanted) for role in ("button", "link"))
            button = button.or_(link).or_(self.tab.locator("summary", has_text=wanted))
            if verb == "open":
                self.tab.goto(f"http://{self.place}{rest}")
            elif verb == "press":
                button.first.click()
            elif verb == "fill":
                label, _, text = rest.partition(": ")
                self.tab.get_by_label(label).first.fill(text)
            elif verb == "see":
                self.tab.get_by_text(rest).first.wait_for()
            elif verb == "download":
                with self.tab.expect_download() as begun:
                    button.first.click()
                begun.value.save_as(self.work / begun.value.suggested_filename)
            else:
                raise ValueError(f"no such step in the browser: {line}")

    def stop(self) -> None:
        """End the server."""
        if self.server is not None:
            self.server.terminate()
            self.server.communicate()
            self.server = None


def plain(text: str) -> str:
    """Return a text with single spaces."""
    return " ".join(text.split())


def follow(page: Path, *first: Path) -> str:
    """Follow a page in a folder of its own, with the programs in ``first``; return what went wrong."""
    with tempfile.TemporaryDirectory() as scratch:
        home, work = Path(scratch, "home"), Path(scratch, "work")
        home.mkdir()
        shutil.copytree(ROOT / "examples", work / "examples", ignore=shutil.ignore_patterns("__pycache__"))
        activate = work / ".venv" / "bin" / "activate"  # the programs are on the PATH already
        activate.parent.mkdir(parents=True)
        activate.touch()
        env = {name: value for name, value in os.environ.items() if not name.startswith(("SILO_", "XDG_"))}
        env |= {name: str(home) for name in ("HOME", "USERPROFILE", "LOCALAPPDATA", "APPDATA")}
        env |= {f"GIT_{who}_{what}": "x@y" for who in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")}
        env["PATH"] = os.pathsep.join((*map(str, first), str(Path(sys.executable).parent), env["PATH"]))
        reader = Reader(Path(scratch), env)
        try:
            return reader.follow(page.read_text("utf-8"))
        finally:
            reader.stop()
            if reader.browser is not None:
                reader.browser.stop()


def main(*pages: str) -> int:
    """Follow all; return 1 if a page is wrong."""
    for page in pages:
        print(f"== {page}")
        problem = follow(Path(page))
        if problem:
            print(problem)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
