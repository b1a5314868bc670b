# SPDX-License-Identifier: LGPL-2.1-or-later
"""What ``--json`` of each command prints: the one description, which ``silo-mod schema`` prints.

The tests hold the commands' real output against it. Files are relative to the folder of the top file (or to
the folder asked for), with ``/``.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

import silo.inertia
from silo.api.wire import MergeResult
from silo.bom.errors import InputError
from silo.bom.findings import FindingCode, Severity
from silo.bom_sync import Status


def schema_of(name: str) -> dict[str, Any]:
    """The schema of a command's JSON. InputError names all that there are."""
    if name not in NAMES:
        raise InputError(f"there is no schema {name!r}; there are: {', '.join(NAMES)}")
    if name in ("inertia", "mass"):
        text = Path(silo.inertia.__file__).with_name("schema.json").read_text(encoding="utf-8")
        schema: dict[str, Any] = json.loads(text)
        return schema
    made = TypeAdapter(SHAPES[name]).json_schema(mode="serialization")
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": f"silo-mod {name} --json"}
    return {**head, **{key: value for key, value in made.items() if key != "title"}}


class Shape(BaseModel):
    """An object with these keys and no others."""

    model_config = ConfigDict(extra="forbid", use_attribute_docstrings=True)


class Place(Shape):
    file: str
    object: str


class Error(Shape):
    code: str
    message: str


class Finding(Shape):
    code: FindingCode
    severity: Severity
    message: str
    where: list[Place]
    file: str = ""
    """the file that a broken link records"""
    did_you_mean: str = ""
    """the file that was probably meant"""


# --- bom ------------------------------------------------------------------------------------------------


class Head(Shape):
    """An assembly."""

    doc_path: str
    object: str
    label: str
    silo_uuid: str | None
    part_number: str | None
    name: str | None


class Entry(Head):
    """A component; ``quantity`` is per one parent."""

    standard: str | None
    """the designation of a standard part"""
    quantity: int
    missing: bool
    level: int
    consolidation_warning: bool
    children: list[Entry]


class Bom(Shape):
    assembly: Head
    entries: list[Entry]
    findings: list[Finding]


class FlatLine(Shape):
    """A component once, with its total."""

    part_number: str | None
    name: str
    quantity: int
    unit: str
    standard: str | None
    doc_path: str
    object: str
    missing: bool


class FolderBoms(Shape):
    """Of a folder: every assembly with its own lines, children first, and the files that cannot be read."""

    assemblies: list[Bom]
    errors: dict[str, str]


class Witnessed(Bom):
    """With --verify: what FreeCAD shows of each assembly."""

    witness: list[dict[str, Any]]


# --- against the server ---------------------------------------------------------------------------------


class Line(Shape):
    part_number: str
    quantity: float | None


class Change(Shape):
    part_number: str
    local_quantity: float
    remote_quantity: float | None


class Diff(Shape):
    """CAD against the server; ``kept``: lines whose file is missing."""

    added: list[Line]
    quantity_changed: list[Change]
    removed: list[Line]
    unchanged: list[Line]
    manual: list[Line]
    conflicts: list[Change]
    kept: list[Line]


class Compared(Shape):
    doc_path: str
    object: str
    part_number: str | None
    name: str | None
    diff: Diff | None = None
    """not there where there was nothing to compare"""


class Files(Shape):
    message: str
    files: list[str]


class Comparison(Shape):
    drift: bool
    assemblies: list[Compared]
    findings: list[Finding]
    errors: list[Files] = []
    """of a folder: what kept files from being compared"""


class Outcome(Shape):
    """What became of one assembly."""

    doc_path: str
    object: str
    part_number: str | None
    status: Status
    diff: Diff | None = None
    result: MergeResult | None = None
    """what the server answered"""
    error: Error | None = None
    blocked_by: list[Finding] = []


class TopResult(Shape):
    """What became of one file; ``skipped``: why it was left alone."""

    top: str
    ok: bool
    assemblies: list[Outcome]
    error: Error | None = None
    skipped: str = ""
    unregistered: list[Entry] = []
    findings: list[Finding] = []


class Unregistered(Shape):
    doc_path: str
    object: str
    label: str


class Moved(Shape):
    name: str
    from_: str = Field(alias="from")
    to: str


class Summary(Shape):
    files: int
    in_order: int
    parts: int
    assemblies: dict[Status, int]
    lines_changed: int
    errors: list[Files]
    warnings: list[Files]
    unregistered: list[Unregistered]
    moved: list[Moved]
    notes: list[str]
    seconds: dict[str, float]
    findings: list[Finding]


class Sync(Shape):
    """Also of ``--report FILE.json``; ``ended`` is false until the run has ended by itself."""

    results: list[TopResult]
    ended: bool
    summary: Summary | None = None


# --- files ----------------------------------------------------------------------------------------------


class Where(Shape):
    doc_path: str
    object: str


class Named(Where):
    name: str
    silo_uuid: str | None
    missing: bool
    moved_from: Where | None


class LineChange(Named):
    change: Literal["added", "removed", "moved", "quantity_changed"]
    old_quantity: int | None
    new_quantity: int | None


class AssemblyChange(Named):
    change: Literal["added", "removed", "moved", "changed"]
    lines: list[LineChange]


class Unreadable(Shape):
    file: str
    reason: str


class State(Shape):
    assemblies: int
    complete: bool
    unreadable: list[Unreadable]
    findings: list[Finding]


class BomDiff(Shape):
    changes: list[AssemblyChange]
    old: State
    new: State


class WhereUsed(Shape):
    part: str
    direct: list[str]
    all: list[str]
    tops: list[str]
    unreadable: list[str]


class RelinkedFile(Shape):
    file: str
    links: int
    objects: list[str]


class Relinked(Shape):
    dry_run: bool
    to: str
    files: list[RelinkedFile]


class Proposed(Shape):
    """A component as it was, or would be, registered; ``note``: why it was left out."""

    doc_path: str
    object: str
    standard: str | None
    name: str
    item_type: str
    category: str
    guess: bool
    """the category was found by little"""
    note: str
    part_number: str | None = None
    silo_uuid: str | None = None
    found: bool = False
    """the item was there already"""
    error: Error | None = None


class Modelled(Shape):
    doc_path: str
    objects: list[str]
    label: str
    quantity: int
    alike: str
    source: str


class Registered(Shape):
    registered: list[Proposed]
    failed: list[Proposed]
    unregistered: list[Proposed]
    modelled: list[Modelled]


class Undeclared(Shape):
    undeclared: list[str]


class PulledFile(Shape):
    path: str
    part_number: str
    revision: int
    state: Literal["new", "same", "updated", "edited", "overwritten", "open"]
    kept: str | None
    """the copy of the user's file"""


class Lost(Shape):
    file: str
    link: str
    reason: str


class Pulled(Shape):
    top: str
    complete: bool
    files: list[PulledFile]
    missing: list[Lost]


class Revision(Shape):
    revision_number: int
    comment: str | None
    created_by: str | None
    created_at: str | None
    file_name: str | None
    file_size: int | None
    base_revision: int | None = None
    bom: str | None = None
    """with --bom: what the revision changed, in words"""


class Log(Shape):
    part_number: str
    file_is: int | None
    """the revision that the file is, or was made from"""
    edited: bool
    revisions: list[Revision]


# --- server and machine ---------------------------------------------------------------------------------


class Greeting(Shape):
    url: str
    token: str | None
    login_url: str | None
    database: str
    public: bool


class Backup(Shape):
    """Of ``backup`` and ``restore``; ``missing_files``: hashes that the server itself had lost."""

    format: int
    schema_: str = Field(alias="schema")
    made_at: str
    database_sha256: str
    rows: dict[str, int]
    files: int
    missing_files: list[str]


class Event(Shape):
    """One line each, as they come."""

    id: str | None
    type: str
    event: str
    data: Any


class Doctor(BaseModel):
    """What was looked at → what was found, or what is wrong with it."""

    model_config = ConfigDict(extra="allow", json_schema_extra={"additionalProperties": {"type": "string"}})
    ok: bool


class Login(Shape):
    url: str
    username: str | None
    role: str | None
    configuration: str


class Addon(Shape):
    freecad: str
    addon: str
    packages: str


class LinkParts(Shape):
    parts: list[str]


class LinkMap(Shape):
    """As the YAML, without its comments; ``silo-mod inertia --links`` reads both."""

    links: dict[str, LinkParts]


SHAPES: dict[str, Any] = {
    "bom": Bom | FolderBoms | Witnessed | list[FlatLine],
    "diff": Comparison,
    "bom-diff": BomDiff,
    "where-used": WhereUsed,
    "relink": Relinked,
    "sync": Sync,
    "register": Registered | Undeclared,
    "pull": Pulled,
    "log": Log,
    "serve": Greeting,
    "backup": Backup,
    "restore": Backup,
    "watch": Event,
    "doctor": Doctor,
    "login": Login,
    "install-addon": Addon,
    "links": LinkMap,
    "schema": list[str],
}

NAMES = (*SHAPES, "inertia", "mass")
