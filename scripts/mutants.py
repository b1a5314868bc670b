#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Plants each mutant of a guard, and runs the tests that reach it: each mutant has to die.

    scripts/mutants.py              all guards of scripts/mutants.toml
    scripts/mutants.py merge send   those whose name or file has one of these words
    scripts/mutants.py --list       the guards; runs nothing

A guard is a rule that keeps data from being lost, doubled or let out. Its mutant replaces a text of a module,
which stands there once, by a text without the rule. The tests run on the code as it is first, then on a copy
with each mutant. Exit code: 0 if all died, 1 if one survived, 2 if the list does not fit the code or the
tests fail without a mutant.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LIST = ROOT / "scripts" / "mutants.toml"
# A mutant may wait for what never comes.
SECONDS = 300


@dataclass(frozen=True)
class Guard:
    """A rule, the text that has it, the text without it, and the tests that fail then."""

    name: str
    file: str
    rule: str
    without: str
    tests: tuple[str, ...]

    def planted(self, source: str) -> str:
        """Return the module with the mutant. ValueError if the rule does not stand there once."""
        if (times := source.count(self.rule)) != 1:
            raise ValueError(f"{self.name}: wanted the rule once in {self.file}, found it {times} times")
        return source.replace(self.rule, self.without)


def guards(path: Path = LIST) -> list[Guard]:
    """Read the list of guards."""
    rows = tomllib.loads(path.read_text("utf-8"))["guard"]
    return [Guard(row["name"], row["file"], row["rule"], row["without"], tuple(row["tests"])) for row in rows]


def tests_pass(root: Path, tests: Sequence[str]) -> bool | None:
    """Run tests in a checkout. None if they could not be run, such as for a test that is not there."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    try:
        ran = subprocess.run(command, cwd=root, capture_output=True, text=True, timeout=SECONDS, check=False)
    except subprocess.TimeoutExpired:
        return False
    if ran.returncode not in (0, 1):
        print(ran.stdout[-2000:], ran.stderr[-2000:], sep="\n", file=sys.stderr)
        return None
    return ran.returncode == 0


def copy_of(root: Path, into: Path) -> Path:
    """Copy what tests need of a checkout, and link to the material beside it."""
    names = subprocess.run(
        ["git", "ls-files", "-coz", "--exclude-standard"],
        cwd=root,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split("\0")
    copied = into / "checkout"
    for name in filter(None, names):
        if (root / name).is_file():
            (copied / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, copied / name)
    if (root.parent / "shared").is_dir():
        (into / "shared").symlink_to(root.parent / "shared")
    return copied


def main(arguments: Sequence[str] | None = None) -> int:
    """Plant and run."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("words", nargs="*", help="part of the name or file of a guard")
    parser.add_argument("--list", action="store_true", help="list the guards; run nothing")
    args = parser.parse_args(arguments)
    chosen = [
        guard for guard in guards() if not args.words or any(w in guard.name + guard.file for w in args.words)
    ]
    if args.list:
        print("\n".join(f"{guard.file}: {guard.name}" for guard in chosen))
        return 0
    try:
        planted = {guard: guard.planted((ROOT / guard.file).read_text("utf-8")) for guard in chosen}
    except (ValueError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    if not tests_pass(ROOT, sorted({test for guard in chosen for test in guard.tests})):
        print("the tests fail without a mutant, or could not be run", file=sys.stderr)
        return 2
    survived = 0
    with tempfile.TemporaryDirectory() as folder:
        root = copy_of(ROOT, Path(folder))
        for guard, mutant in planted.items():
            module = root / guard.file
            before = module.read_text("utf-8")
            module.write_text(mutant, "utf-8")
            died = tests_pass(root, guard.tests) is False
            module.write_text(before, "utf-8")
            survived += not died
            print(f"{'died    ' if died else 'SURVIVED'} {guard.file}: {guard.name}", flush=True)
    print(f"{len(planted) - survived} of {len(planted)} mutants died")
    return 1 if survived else 0


if __name__ == "__main__":
    sys.exit(main())
