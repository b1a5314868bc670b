#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs the steps of a Containerfile in a bare root, for machines without a container engine.

    debootstrap --variant=minbase --include=ca-certificates,python3-pip,python-is-python3 bookworm ROOT
    scripts/container_steps.py deploy/Containerfile ROOT

RUN, COPY, USER, ENV, WORKDIR, ENTRYPOINT and CMD have the effect that an engine gives them; FROM, VOLUME and
EXPOSE have none. CMD runs until the command of HEALTHCHECK succeeds, and is ended as an engine ends it
(SIGTERM). Needs root rights; exit code 1 if a step fails. The root is changed. The steps have pip's settings
from the environment, and the certificates that it names.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

REPO = Path(__file__).resolve().parents[1]
SECONDS = 120


def instructions(text: str) -> list[tuple[str, str]]:
    """Return the instructions of a Containerfile and their arguments, with continued lines joined."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    joined = re.sub(r"\\\n\s*", "", "\n".join(lines))
    return [(name, rest) for name, _, rest in (line.partition(" ") for line in joined.splitlines()) if rest]


class Root:
    """A root folder, and what the steps so far say of user, folder and environment."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.user, self.work = folder, "root", "/"
        given = {name: value for name, value in os.environ.items() if name.startswith(("PIP_", "SSL_CERT"))}
        # An image of Python has one that pip may write to.
        self.environment = {
            "PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin",
            "PIP_BREAK_SYSTEM_PACKAGES": "1",
            **given,
        }

    def start(self, words: list[str]) -> subprocess.Popen[bytes]:
        """Start a command as an engine would."""
        inside = f"cd {shlex.quote(self.work)} && exec {shlex.join(words)}"
        chroot = ["chroot", f"--userspec={self.user}", str(self.folder), "/bin/sh", "-c", inside]
        return subprocess.Popen(chroot, env=self.environment)

    def copy(self, sources: list[str], target: str) -> None:
        """Copy files, and what is in folders, from the repository."""
        for source in sources:
            place = self.folder / target.lstrip("/")
            if (REPO / source).is_dir():
                shutil.copytree(
                    REPO / source,
                    place,
                    dirs_exist_ok=True,
                    ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"),
                )
            else:
                place = place / Path(source).name if target.endswith("/") else place
                place.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(REPO / source, place)


def main(container: Path, folder: Path) -> int:
    """Run all steps; 0 if the container becomes healthy and ends."""
    root, health, command = Root(folder), [], []
    if trusted := os.environ.get("SSL_CERT_FILE"):
        place = folder / trusted.lstrip("/")
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(trusted, place)
    for name, rest in instructions(container.read_text("utf-8")):
        print(f"{name} {rest}", flush=True)
        match name:
            case "RUN":
                if root.start(["/bin/sh", "-c", rest]).wait():
                    return 1
            case "COPY":
                *sources, target = shlex.split(re.sub(r"--\S+ ", "", rest))
                root.copy(sources, target)
            case "ENV":
                root.environment |= dict(pair.split("=", 1) for pair in shlex.split(rest))
            case "USER":
                root.user = rest
            case "WORKDIR":
                root.work = rest
            case "HEALTHCHECK":
                health = json.loads(rest.partition("CMD ")[2])
            case "ENTRYPOINT" | "CMD":
                command += json.loads(rest)
    running = root.start(command)
    until = time.monotonic() + SECONDS
    healthy = not health and running.wait() == 0
    while health and running.poll() is None and not healthy and time.monotonic() < until:
        time.sleep(1)
        healthy = root.start(health).wait() == 0
    running.send_signal(signal.SIGTERM)
    code = running.wait(60)
    print(f"{'healthy' if healthy else 'not healthy'}; ended with {code}")
    return 0 if healthy else 1


if __name__ == "__main__":
    sys.exit(main(*map(Path, sys.argv[1:3])))
