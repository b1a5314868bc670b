# SPDX-License-Identifier: LGPL-2.1-or-later
"""Text that goes to a file or a pipe is never cropped or folded: it holds all that ``--json`` holds."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, locals_, part

from silo.cli.parser import build_parser

LONG = "bracket of the left hand side, milled from one piece, with a name as people give them to files"
DEEP = "mechanics/of the machine/parts that we make ourselves"
PART, GONE = f"{DEEP}/{LONG}.FCStd", f"{DEEP}/gone from {LONG}.FCStd"

# What only programs read, and what people read in other words: a severity is a mark.
MACHINE = {"code", "severity", "status", "state", "change", "silo_uuid", "item_type", "unit", "alike"}
MACHINE |= {"template", "plural"}  # of a message, whose sentence has the values
# The command in words, and what else of its JSON the text does not have: the label of a named item;
# the object, if the name stands for it; the file of a finding, which its message has; what the caller typed.
COMMANDS: dict[str, tuple[Sequence[str], set[str]]] = {
    "register": (("register", "vault/top.FCStd", "--yes"), {"object", "category"}),
    "bom": (("bom", "vault/top.FCStd"), {"label", "where"}),
    "bom, flat": (("bom", "vault/top.FCStd", "--flat"), set()),
    "bom, resolved": (("bom", "vault/top.FCStd", "--resolve"), {"label", "where"}),
    "bom of a folder": (("bom", "vault"), {"label", "where"}),
    "diff": (("diff", "vault/top.FCStd", "--recursive"), {"where"}),
    "diff of a folder": (("diff", "vault"), {"where", "unchanged", "object"}),
    "bom-diff": (("bom-diff", "empty", "vault"), {"object", "where"}),
    "where-used": (("where-used", f"vault/{PART}", "--root", "vault"), {"part"}),
    "relink": (("relink", "vault/sub.FCStd", "--from", GONE, "--to", PART, "--dry-run"), {"objects"}),
    "sync": (("sync", "vault/top.FCStd", "--recursive", "--dry-run"), {"top", "where", "object", "summary"}),
    # Without --verbose it is a mail of one screen, which names three files of each cause.
    "sync of a folder": (
        ("sync", "vault", "--dry-run", "--verbose"),
        {"top", "skipped", "where", "object", "cause"},
    ),
    "status": (("status", "vault"), {"document", "items"}),
    "pull": (("pull", "A01-0001", "--into", "pulled"), set()),
    "search": (("search", "bracket"), set()),
    "show": (("show", "A01-0001"), set()),
    "whoami": (("whoami",), set()),
    "log": (("log", "vault/top.FCStd"), {"file_name", "created_at"}),
    "order": (
        ("order", "A01-0001", "--quantity", "7"),
        {"total", "costs", "path", "prices", "minimum", "pack_size"},
    ),
}
WITHOUT = {
    *("serve", "backup", "restore", "summaries", "watch", "login"),  # a few plain lines
    *("install-addon", "doctor", "logout"),
    *("demo", "schema", "links", "completion", "help"),  # one form only
    *("inertia", "mass"),  # tests/inertia/output
    "queue",  # tests/cli/test_queue.py
    "import",  # rows that stay the same are counted (tests/cli/test_import_table.py)
    "commit",  # its second run finds what the first one sent (tests/cli/test_project.py)
}


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An assembly with a sub-assembly, names that are long, and a file that is missing."""
    folder = tmp_path / "vault"
    (folder / DEEP).mkdir(parents=True)
    (tmp_path / "empty").mkdir()
    part("part", "Box", Label=LONG).save(folder / PART)
    sub = Doc(label="sub").link("L1", PART, "Box").link("L2", GONE, "Box")
    sub.add("App::Part", "Sub", Label=f"Sub with the {LONG}", Group=locals_("L1", "L2"), Type="Assembly")
    sub.save(folder / "sub.FCStd")
    top = Doc(label="top").link("L1", "sub.FCStd", "Sub").link("L2", PART, "Box")
    top.add("App::Part", "Top", Label="Top", Group=locals_("L1", "L2"), Type="Assembly")
    top.save(folder / "top.FCStd")
    monkeypatch.chdir(tmp_path)
    return folder


def strings(data: Any, without: set[str]) -> Iterator[str]:
    """Yield each string of JSON that people read too."""
    if isinstance(data, dict):
        for name, value in data.items():
            if name not in MACHINE | without:
                yield from strings(value, without)
    elif isinstance(data, list):
        for value in data:
            yield from strings(value, without)
    elif isinstance(data, str):
        yield data


def test_piped_text_holds_every_string_of_the_json(run: Any, silo: Any, project: Path) -> None:
    """In the order of the table: registered at first, nothing synced until the order list."""
    for name, (words, without) in COMMANDS.items():
        if name == "order":
            run("sync", "vault", "--allow-missing")
            for line in silo.client.get_bom("A01-0001"):
                sold = {
                    "supplier": f"Misumi, {LONG}",
                    "supplier_part_number": LONG[::-1],
                    "standard_cost": 0.25,
                }
                silo.client.update_item(line.child_part_number, properties=sold)
        text = run(*words)
        found = run(*words, "--json").json()
        missing = {one for one in strings(found, without) if one not in text.out + text.err}
        assert not missing, (name, text.out)
        if name == "register":
            run("register", "vault", "--yes")
            for item in silo.client.search_items():
                silo.client.upload_file(item.part_number, project / "top.FCStd", LONG)


def test_every_command_is_in_the_table() -> None:
    (known,) = (a.choices for a in build_parser()._actions if isinstance(a, argparse._SubParsersAction))
    assert {words[0] for words, _ in COMMANDS.values()} | WITHOUT == set(known)
