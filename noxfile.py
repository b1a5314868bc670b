# SPDX-License-Identifier: LGPL-2.1-or-later
"""The tasks of the Makefile for machines without make, such as Windows: ``pipx run nox -s test``.

nox makes an environment for each task. On Linux ``make`` does the same with one environment, and is quicker.
"""

from __future__ import annotations

import nox

nox.options.sessions = ["check", "test", "platform"]
SPREAD = ("-n", "logical", "--maxprocesses", "8")


@nox.session
def check(session: nox.Session) -> None:
    """ruff, mypy, import directions, plain English."""
    session.install("--editable", ".[dev]")
    session.run("ruff", "check", ".")
    session.run("ruff", "format", "--check", ".")
    session.run("mypy")
    session.run("lint-imports")
    session.run("python", "scripts/english.py")
    session.run("codespell")


@nox.session(python=["3.11", "3.13"])
def test(session: nox.Session) -> None:
    """The tests that need neither FreeCAD nor a browser."""
    session.install("--editable", ".[dev]")
    marks = "not freecad and not browser"
    session.run("pytest", *SPREAD, "--dist", "worksteal", "-m", marks, *session.posargs)


@nox.session
def windows_files(session: nox.Session) -> None:
    """On Linux: the suites that read and write files, with files as Windows has them."""
    session.install("--editable", ".[dev]")
    session.run("make", "test-windows-files", "VENV=" + session.virtualenv.location, external=True)


@nox.session
def platform(session: nox.Session) -> None:
    """What differs between platforms, run for real: demo, port, patterns, geometry."""
    session.install("--editable", ".[server,inertia]")
    session.run("python", "scripts/platform_checks.py")


@nox.session
def machine(session: nox.Session) -> None:
    """The tests that need the FreeCAD or the Chromium of this machine."""
    session.install("--editable", ".[dev]")
    session.run("pytest", *SPREAD, "--dist", "loadscope", "-m", "freecad or browser", *session.posargs)
