# SPDX-License-Identifier: LGPL-2.1-or-later
"""A process that has loaded the geometry kernel and the command line, and forks readers and commands.

The kernel takes a second of processor to load, and some hundred tests read in a child; the commands of the
documentation take half a second each. A process that is started for such work gives it away, waits, and ends
as the work ended: by the same code, or by the same signal.
"""

from __future__ import annotations

import json
import os
import select
import shlex
import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager

NAME = "SILO_WARM_READER"
WORK = (
    "from silo.inertia.geometry.worker import main; main()",
    "from silo.drawing.models import main; main()",
)
COMMAND = "from silo.cli.main import main; raise SystemExit(main())"
LOADED = """
from silo.inertia.geometry.worker import without
without("scipy", "networkx")
import silo.drawing.models, silo.inertia.geometry.step, silo.inertia.geometry.meshes
import silo.api.client, silo.bom_sync, silo.cli.main
"""
# They run until a signal ends them, which the process gets that was started.
LASTING = {"serve", "watch"}


@contextmanager
def warm_reader() -> Iterator[str]:
    """Start it; it loads the kernel with its first job. Children use it if ``NAME`` is what this gives."""
    import subprocess
    from uuid import uuid4

    path = os.pathsep.join(part for part in sys.path if part)
    environment = {**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    with socket.socket(socket.AF_UNIX) as listener:
        address = f"silo-reader-{uuid4()}"
        listener.bind(f"\0{address}")
        listener.listen(100)
        process = subprocess.Popen(
            [sys.executable, __file__, str(listener.fileno())],
            stdin=subprocess.PIPE,
            env=environment,
            pass_fds=[listener.fileno()],
        )
        with process:  # its input ends with this block, or with this process; then it ends as well
            yield f"{address}\n{path}"


def pass_on(code: str) -> None:
    """Let the warm process do what this child was started for, if it is the same code with the same path."""
    address, path = os.environ[NAME].split("\n")
    if code in WORK and os.environ.get("PYTHONPATH") == path:
        _hand_over(address, code)


def run_command(reader: str) -> None:
    """Let the warm process ``reader`` run ``silo-mod`` with the arguments of this process."""
    if LASTING.intersection(sys.argv[1:2]):
        os.execv(sys.executable, [sys.executable, "-c", COMMAND, *sys.argv[1:]])
    os.environ[NAME] = reader
    _hand_over(reader.split("\n")[0], COMMAND)


def stand_in(reader: str) -> str:
    """Return a program for the shell that runs ``silo-mod`` in the warm process ``reader``."""
    here = os.path.dirname(os.path.abspath(__file__))
    code = f"import sys; sys.path.append({here!r}); import warm_reader; warm_reader.run_command({reader!r})"
    return f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -IS -c {shlex.quote(code)} "$@"\n'


def _hand_over(address: str, code: str) -> None:
    with socket.socket(socket.AF_UNIX) as line:
        line.connect(f"\0{address}")
        job = json.dumps([code, os.getcwd(), dict(os.environ), ["silo-mod", *sys.argv[1:]]]).encode()
        socket.send_fds(line, [len(job).to_bytes(4)], [0, 1, 2])
        line.sendall(job)
        ended = line.makefile().readline()
    if int(ended) < 0:
        os.kill(os.getpid(), -int(ended))
    os._exit(int(ended))


def serve(listener: socket.socket) -> None:
    """Fork a process for each job until the standard input ends."""
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    while 0 not in select.select([listener, 0], [], [])[0]:
        if "silo" not in sys.modules:
            exec(LOADED)
        line, _ = listener.accept()
        if os.fork() == 0:
            watch(line, listener)
        line.close()


def watch(line: socket.socket, listener: socket.socket) -> None:
    """Do the job in one more process; end that with all it started if the child that waits for it ends."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    listener.close()
    length, fds, _, _ = socket.recv_fds(line, 4, 3)
    code, folder, environment, sys.argv = json.loads(line.makefile("rb").read(int.from_bytes(length)))
    worker = os.fork()
    if worker == 0:
        os.setsid()
        for number, fd in enumerate(fds):
            os.dup2(fd, number)
        os.chdir(folder)
        os.environ.clear()
        os.environ.update(environment)
        sys.stdin, sys.stdout, sys.stderr = open(0), open(1, "w", 1), open(2, "w", 1)  # noqa: SIM115
        line.close()
        sys.exit(exec(code))
    for fd in fds:
        os.close(fd)
    done = os.pidfd_open(worker)
    ready, _, _ = select.select([done, line], [], [])
    if done not in ready:
        os.killpg(worker, signal.SIGKILL)
    _, status = os.waitpid(worker, 0)
    if done in ready:
        line.sendall(b"%d\n" % os.waitstatus_to_exitcode(status))
    os._exit(0)


if __name__ == "__main__":
    serve(socket.socket(fileno=int(sys.argv[1])))
