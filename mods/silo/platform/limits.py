# SPDX-License-Identifier: LGPL-2.1-or-later
"""Limits of this process: memory, processor time, open files; Windows has none."""

from __future__ import annotations

from contextlib import suppress
from typing import Protocol


class Resources(Protocol):
    """The part of the module ``resource`` that is used; Windows has no such module."""

    RLIMIT_AS: int
    RLIMIT_CORE: int
    RLIMIT_CPU: int
    RLIMIT_NOFILE: int

    def getrlimit(self, which: int, /) -> tuple[int, int]: ...

    def setrlimit(self, which: int, limits: tuple[int, int], /) -> None: ...


def _resources() -> Resources | None:
    try:
        import resource
    except ImportError:
        return None
    return resource


def limit_this_process(
    *, memory: int = 0, cpu_s: int = 0, resources: Resources | None = None
) -> tuple[str, ...]:
    """Limit this process as far as the platform can, each limit separately; no core files.

    memory, cpu_s
        bytes of address space and seconds of processor time; 0 for no limit.

    Returns the names of the limits that could not be set: Windows has no limits, and macOS refuses that of
    memory.
    """
    system = resources or _resources()
    wanted = {"core": 0, **({"memory": memory} if memory else {}), **({"cpu": cpu_s} if cpu_s else {})}
    if system is None:
        return tuple(wanted)
    which = {"core": system.RLIMIT_CORE, "memory": system.RLIMIT_AS, "cpu": system.RLIMIT_CPU}
    refused = []
    for name, most in wanted.items():
        try:
            system.setrlimit(which[name], (most, most + 5 if name == "cpu" else most))
        except (ValueError, OSError):
            refused.append(name)
    return tuple(refused)


def allow_many_files() -> None:
    """Raise the limit of open files to what the machine allows, since each listener of a server needs one."""
    system = _resources()
    if system is None:
        return
    with suppress(OSError, ValueError):  # macOS names no limit as the limit, and then refuses it
        _, hard = system.getrlimit(system.RLIMIT_NOFILE)
        system.setrlimit(system.RLIMIT_NOFILE, (hard, hard))
