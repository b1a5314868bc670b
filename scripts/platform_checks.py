# SPDX-License-Identifier: LGPL-2.1-or-later
"""What differs between Windows, macOS and Linux, run for real on this machine; exit code 0 where all is well.

    python scripts/platform_checks.py

Needs the extras ``server`` and ``inertia``. Nothing of the user's own folders is touched.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

ROOT = Path(__file__).resolve().parents[1]
SECONDS = 300


def environment(folder: Path, more: Mapping[str, str] = MappingProxyType({})) -> dict[str, str]:
    """For a child: our modules, and none of the user's own folders."""
    own = {"SILO_HOME": str(folder / "home"), "PYTHONPATH": str(ROOT / "mods"), "PYTHONUTF8": "1"}
    return {**os.environ, **own, **more}


def silo_mod(
    *words: str | Path, cwd: Path, code: int = 0, more: Mapping[str, str] = MappingProxyType({})
) -> str:
    """Run a command; its output. AssertionError where it ends in another way than wanted."""
    done = subprocess.run(
        [sys.executable, "-m", "silo.cli.main", *map(str, words)],
        cwd=cwd,
        env=environment(cwd, more),
        capture_output=True,
        encoding="utf-8",
        timeout=SECONDS,
        check=False,
    )
    said = f"{done.stdout}\n{done.stderr}".strip()
    assert done.returncode == code, f"silo-mod {words[0]}: exit code {done.returncode}, wanted {code}\n{said}"
    return done.stdout


def demo(folder: Path) -> None:
    """The main job on the embedded server."""
    assert "Database Activity" in silo_mod("demo", cwd=folder)


def server(folder: Path) -> None:
    """A second server on a port that is taken is refused; ``*.FCStd`` is expanded, as cmd does not."""
    shutil.copytree(ROOT / "examples" / "gearbox", folder / "gearbox")
    words = [sys.executable, "-m", "silo.cli.main", "serve", "--port", "0", "--json"]
    pipe = subprocess.PIPE
    with subprocess.Popen(words, cwd=folder, env=environment(folder), stdout=pipe, stderr=pipe) as first:
        assert first.stdout is not None
        try:
            greeting = json.loads(first.stdout.readline() or b"{}")
            assert greeting, "the server did not start"
            port = greeting["url"].rpartition(":")[2]
            silo_mod("serve", "--port", port, cwd=folder, code=2)
            known = {"SILO_API_URL": greeting["url"], "SILO_API_TOKEN": greeting["token"]}
            pattern = folder / "gearbox" / "*.FCStd"
            data = json.loads(silo_mod("sync", pattern, "--json", cwd=folder, code=1, more=known))
            found = sorted(Path(result["top"]).name for result in data["results"])
            assert found == ["Gearbox.FCStd", "TopAssembly.FCStd"], found
        finally:
            first.terminate()
            first.communicate(timeout=SECONDS)


def geometry(folder: Path) -> None:
    """A STEP file is read in a process of its own, with the limits that this platform has."""
    arm = ROOT / "examples" / "arm"
    out = silo_mod("inertia", arm / "arm.step", "--bom", arm / "bom.csv", "--json", cwd=folder)
    assert json.loads(out)["links"]


def main() -> int:
    """Run all; report each."""
    checks: list[Callable[[Path], None]] = [demo, server, geometry]
    failed = 0
    for check in checks:
        with tempfile.TemporaryDirectory(prefix="silo-check-", ignore_cleanup_errors=True) as folder:
            try:
                check(Path(folder))
                print(f"ok      {check.__name__}: {check.__doc__}")
            except (AssertionError, OSError, ValueError, KeyError, subprocess.SubprocessError) as error:
                failed += 1
                print(f"FAILED  {check.__name__}: {error}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
