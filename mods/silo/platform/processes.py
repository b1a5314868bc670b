# SPDX-License-Identifier: LGPL-2.1-or-later
"""Child processes: they start without a window, share work, end together; what their exit codes mean."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from silo.bom.message import message
from silo.platform.system import WINDOWS

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor


def child_options(*, group: bool = False, offered: object = subprocess) -> dict[str, Any]:
    """Return options of ``subprocess`` for a child without a window: Windows then opens no console.

    group
        the child and its own children can be ended together, by :func:`end`.
    offered
        a module that has the flags of this platform.
    """
    if flags := getattr(offered, "CREATE_NO_WINDOW", 0):
        return {"creationflags": flags | (getattr(offered, "CREATE_NEW_PROCESS_GROUP", 0) if group else 0)}
    return {"start_new_session": True} if group else {}


def end(process: subprocess.Popen[Any]) -> None:
    """End a child that was started with ``child_options(group=True)``, and wait for it."""
    if process.poll() is None:
        if hasattr(os, "killpg"):
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()
        process.wait()


def processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def workers(count: int, begin: Callable[..., None], *arguments: Any) -> ProcessPoolExecutor:
    """Start a pool of worker processes. They leave Ctrl-C to this process, and none outlives it.

    ``begin`` is called in each of them, with the arguments.
    """
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_all_start_methods, get_context

    # Never by fork: a library may have threads that hold locks.
    context = get_context("forkserver" if "forkserver" in get_all_start_methods() else "spawn")
    return ProcessPoolExecutor(count, context, initializer=_begin_worker, initargs=(begin, arguments))


def _begin_worker(begin: Callable[..., None], arguments: tuple[Any, ...]) -> None:
    from multiprocessing import parent_process

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if (parent := parent_process()) is not None:

        def watch() -> None:
            parent.join()
            os._exit(1)

        threading.Thread(target=watch, daemon=True).start()
    begin(*arguments)


def end_workers(pool: ProcessPoolExecutor) -> None:
    """End a pool at once, whatever its processes do; from 3.14 on Python can do this itself."""
    for process in list(pool._processes.values()):
        process.kill()
    pool.shutdown(wait=True, cancel_futures=True)


_CRASHES = {"SIGSEGV", "SIGABRT", "SIGILL", "SIGBUS", "SIGFPE"}


def how_it_ended(code: int) -> str:
    """Describe the exit code of a child, such as ``crashed (SIGSEGV)`` or ``ended with exit code 3``.

    A shell that started the child adds 128 to the signal; Windows has codes from 0xC0000000 on for crashes.
    """
    names = {int(number): number.name for number in signal.Signals}
    name = names.get(code - 128 if code > 128 else -code, str(-code) if code < 0 else "")
    if code >= 0xC0000000:
        return message("crashed (0x{code})", code=f"{code:08X}")
    if name:
        return f"{'crashed' if name in _CRASHES else 'was ended'} ({name})"
    return message("ended with exit code {code}", code=code)


def python_beside(prefix: str) -> list[str]:
    """Return the paths at which a Python interpreter may be below its prefix."""
    names = ("python.exe", "bin/python.exe") if WINDOWS else ("bin/python3", "bin/python")
    return [os.path.join(prefix, *name.split("/")) for name in names]
