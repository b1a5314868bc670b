# SPDX-License-Identifier: LGPL-2.1-or-later
"""What ``--json`` of each command prints: the one description, which ``silo-mod schema`` prints.

The tests hold the commands' real output against it. Files are relative to the folder of the top file (or to
the folder asked for), with ``/``.
"""

from __future__ import annotations

import json
from pathlib import Path
from types import GenericAlias
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, create_model

import silo.inertia
from silo.api.wire import MergeResult, OrderList, ProductSummary
from silo.bom.findings import FindingCode, Severity
from silo.bom_sync.steps import Status


def schema_of(name: str) -> dict[str, Any]:
    """Return the schema of a command's JSON; KeyError for a name that is not in ``NAMES``."""
    if name not in NAMES:
        raise KeyError(name)
    if name in ("inertia", "mass"):
        text = Path(silo.inertia.__file__).with_name("schema.json").read_text(encoding="utf-8")
        schema: dict[str, Any] = json.loads(text)
        return schema
    made = TypeAdapter(SHAPES[name]).json_schema(mode="serialization")
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": f"silo-mod {name} --json"}
    return {**head, **{key: value for key, value in made.items() if key != "title"}}


class JsonForm(BaseModel):
    """An object with these keys and no others."""

    model_config = ConfigDict(extra="forbid")


class _Open(BaseModel):
    model_config = ConfigDict(extra="allow", json_schema_extra={"additionalProperties": {"type": "string"}})


def _shape(title: str, /, base: type[BaseModel] = JsonForm, doc: str = "", **keys: Any) -> Any:
    """Make a model; each key has its type, or (type, default) if it may be left out."""
    fields: dict[str, Any] = {}
    for key, given in keys.items():
        kind, *default = given if isinstance(given, tuple) else (given,)
        alias = key.removesuffix("_")  # from_ and schema_, whose names mean something else already
        fields[key] = (kind, Field(*default, alias=alias if alias != key else None))
    return create_model(title, __base__=base, __doc__=doc or None, __module__=__name__, **fields)


def _many(kind: Any) -> Any:
    return GenericAlias(list, (kind,))


def _described(kind: Any, words: str) -> Any:
    return Annotated[kind, Field(description=words)]


Place = _shape(
    "Place",
    file=str,
    object=str,
    standing=(_described(str, "of a hidden object: counts, not counted or reference"), ""),
)
# What a message is made of, beside its English sentence.
_MADE_OF: dict[str, Any] = {
    "template": (_described(str, "the message with {name} for each value: its code"), ""),
    "plural": (_described(str, "the template for other numbers than one"), ""),
    "values": (_described(dict[str, Any], "name → text, number, or a message of its own"), {}),
}
Error = _shape("Error", code=str, message=str, **_MADE_OF)
Finding = _shape(
    "Finding",
    code=FindingCode,
    severity=Severity,
    message=str,
    **_MADE_OF,
    where=_many(Place),
    file=(_described(str, "the file that a broken link records"), ""),
    did_you_mean=(_described(str, "the file that was probably meant"), ""),
)
Head = _shape(
    "Head",
    doc="An assembly.",
    doc_path=str,
    object=str,
    label=str,
    silo_uuid=str | None,
    part_number=str | None,
    name=str | None,
)
Entry = _shape(
    "Entry",
    base=Head,
    doc="A component; ``quantity`` is per one parent.",
    standard=_described(str | None, "the designation of a standard part"),
    variant=(_described(str, "the values of a configured copy"), ""),
    quantity=int,
    missing=bool,
    level=int,
    consolidation_warning=bool,
    children="list[Entry]",
    own=(_described("list[Entry]", "what an assembly shows of its own file and is no item yet"), []),
)
Bom = _shape(
    "Bom",
    assembly=Head,
    entries=_many(Entry),
    own=(_described(_many(Entry), "what the assembly shows of its own file and is no item yet"), []),
    findings=_many(Finding),
    silo=(_described(ProductSummary | None, "with --resolve: what the server keeps of the product"), None),
)
FlatLine = _shape(
    "FlatLine",
    doc="A component once, with its total.",
    part_number=str | None,
    name=str,
    quantity=int,
    unit=str,
    standard=str | None,
    doc_path=str,
    object=str,
    missing=bool,
    variant=(_described(str, "the values of a configured copy"), ""),
)
FolderBoms = _shape(
    "FolderBoms",
    doc="Of a folder: every assembly with its own lines, children first, and the files that cannot be read.",
    assemblies=_many(Bom),
    errors=dict[str, str],
)
Witnessed = _shape(
    "Witnessed",
    base=Bom,
    doc="With --verify: what FreeCAD shows of each assembly.",
    witness=list[dict[str, Any]],
)
Line = _shape("Line", part_number=str, quantity=float | None)
Change = _shape("Change", part_number=str, local_quantity=float, remote_quantity=float | None, unit=(str, ""))
Diff = _shape(
    "Diff",
    doc="CAD against the server; ``kept``: lines whose file is missing.",
    added=_many(Line),
    quantity_changed=_many(Change),
    removed=_many(Line),
    unchanged=_many(Line),
    manual=_many(Line),
    conflicts=_many(Change),
    kept=_many(Line),
)
Compared = _shape(
    "Compared",
    doc_path=str,
    object=str,
    part_number=str | None,
    name=str | None,
    diff=(_described(Diff | None, "not there where there was nothing to compare"), None),
)
Files = _shape("Files", message=str, files=list[str])
Comparison = _shape(
    "Comparison",
    drift=bool,
    assemblies=_many(Compared),
    findings=_many(Finding),
    errors=(
        _described(_many(Files), "of a folder: what kept files from being compared"),
        [],
    ),
)
Outcome = _shape(
    "Outcome",
    doc="What became of one assembly.",
    doc_path=str,
    object=str,
    part_number=str | None,
    status=Status,
    diff=(Diff | None, None),
    result=(_described(MergeResult | None, "what the server answered"), None),
    error=(Error | None, None),
    blocked_by=(_many(Finding), []),
)
TopResult = _shape(
    "TopResult",
    doc="What became of one file; ``skipped``: why it was left alone.",
    top=str,
    ok=bool,
    assemblies=_many(Outcome),
    error=(Error | None, None),
    skipped=(str, ""),
    unregistered=(_many(Entry), []),
    findings=(_many(Finding), []),
)
Caused = _shape("Caused", base=Files, cause=_described(str, "what several have in common"))
Unregistered = _shape("Unregistered", doc_path=str, object=str, label=str)
Moved = _shape("Moved", name=str, from_=str, to=str)
Summary = _shape(
    "Summary",
    files=int,
    in_order=int,
    parts=int,
    assemblies=dict[Status, int],
    not_sent=_described(int, "assemblies that the server, or the way to it, kept from being sent"),
    lines_changed=int,
    new=_described(list[str] | None, "what the run before did not have; null if it is not known"),
    errors=_many(Caused),
    warnings=_many(Caused),
    unregistered=_many(Unregistered),
    moved=_many(Moved),
    notes=list[str],
    seconds=dict[str, float],
    findings=_many(Finding),
)
Sync = _shape(
    "Sync",
    doc="Also of ``--report FILE.json``; ``ended`` is false until the run has ended by itself.",
    results=_many(TopResult),
    ended=bool,
    summary=(Summary | None, None),
)
Where = _shape("Where", doc_path=str, object=str)
Named = _shape("Named", base=Where, name=str, silo_uuid=str | None, missing=bool, moved_from=Where | None)
LineChange = _shape(
    "LineChange",
    base=Named,
    change=Literal["added", "removed", "moved", "quantity_changed"],
    old_quantity=int | None,
    new_quantity=int | None,
)
AssemblyChange = _shape(
    "AssemblyChange",
    base=Named,
    change=Literal["added", "removed", "moved", "changed"],
    lines=_many(LineChange),
)
Unreadable = _shape("Unreadable", file=str, reason=str)
State = _shape("State", assemblies=int, complete=bool, unreadable=_many(Unreadable), findings=_many(Finding))
BomDiff = _shape("BomDiff", changes=_many(AssemblyChange), old=State, new=State)
WhereUsed = _shape(
    "WhereUsed", part=str, direct=list[str], all=list[str], tops=list[str], unreadable=list[str]
)
RelinkedFile = _shape("RelinkedFile", file=str, links=int, objects=list[str])
Relinked = _shape("Relinked", dry_run=bool, to=str, files=_many(RelinkedFile))
Proposed = _shape(
    "Proposed",
    doc="A component as it was, or would be, registered; ``note``: why it was left out.",
    doc_path=str,
    object=str,
    standard=str | None,
    name=str,
    item_type=str,
    category=str,
    guess=_described(bool, "the category was found by little"),
    note=str,
    part_number=(str | None, None),
    silo_uuid=(str | None, None),
    found=(_described(bool, "the item was there already"), False),
    error=(Error | None, None),
)
Modelled = _shape("Modelled", doc_path=str, objects=list[str], label=str, quantity=int, alike=str, source=str)
Registered = _shape(
    "Registered",
    registered=_many(Proposed),
    failed=_many(Proposed),
    unregistered=_many(Proposed),
    modelled=_many(Modelled),
)
Undeclared = _shape("Undeclared", undeclared=list[str])
Answered = _shape("Answered", counted=list[str], references=list[str])
Orphan = _shape(
    "Orphan", part_number=str, name=str, component=_described(str, "file#object that it was made for")
)
Orphans = _shape("Orphans", orphans=_many(Orphan))
Archived = _shape("Archived", archived=_many(Orphan))
PulledFile = _shape(
    "PulledFile",
    path=str,
    part_number=str,
    revision=int,
    state=Literal["new", "same", "updated", "edited", "overwritten", "open"],
    kept=_described(str | None, "the copy of the user's file"),
)
Lost = _shape("Lost", file=str, link=str, reason=str)
Pulled = _shape(
    "Pulled", top=str, complete=bool, files=_many(PulledFile), missing=_many(Lost), remarks=list[str]
)
Standing = _shape(
    "Standing",
    path=str,
    state=Literal["same", "new", "edited", "newer", "both", "waiting", "held", "server set back", "unknown"],
    document=str | None,
    items=int,
    moved_from=str | None,
    newest=_described(int | None, "the newest revision in Silo"),
    held_bom=_described(str | None, "why its BOM could not be sent"),
)
_ProjectLink = _shape("ProjectLink", file=str, link=str)
ProjectStatus = _shape(
    "ProjectStatus",
    root=str,
    files=_many(Standing),
    outside=_many(_ProjectLink),
    missing=_many(_ProjectLink),
    unreadable=_many(_shape("Unreadable", file=str, reason=str)),
    gone=list[str],
    copies=_many(_shape("Copy", file=str, of=str)),
)
SentFile = _shape(
    "SentFile",
    path=str,
    part_number=str,
    revision=int | None,
    bom=str | None,
    remark=str,
    blocked_by=_described(list[str], "why its BOM is held"),
)
Committed = _shape(
    "Committed",
    base=ProjectStatus,
    sent=_many(SentFile),
    waiting=_many(_shape("InQueue", path=str, reason=str)),
    models=_described(int, "how many files Silo can show in 3D since"),
    undrawn=_described(list[str], "why it cannot show others"),
)
Revision = _shape(
    "Revision",
    revision_number=int,
    comment=str | None,
    created_by=str | None,
    created_at=str | None,
    file_name=str | None,
    file_size=int | None,
    base_revision=(int | None, None),
    bom=(_described(str | None, "with --bom: what the revision changed, in words"), None),
)
_Waiting = _shape(
    "Waiting",
    part_number=str,
    label=str,
    path=str,
    what=str,
    state=str,
    reason=str,
    server=str,
    number=int,
    since=_described(float, "seconds since 1970"),
    needs_a_person=bool,
)
Queue = _shape("Queue", pause=str | None, items=_many(_Waiting), total=int)

Log = _shape(
    "Log",
    part_number=str,
    file_is=_described(int | None, "the revision that the file is, or was made from"),
    edited=bool,
    revisions=_many(Revision),
)
Changed = _shape(
    "Changed",
    doc="Of ``log --since``.",
    part_number=str,
    since=str,
    to=str,
    changes=_many(
        _shape(
            "ProductChange",
            what=Literal["added", "removed", "quantity", "line", "data", "file"],
            within=_described(str, "the part number of the BOM; empty for an item's data and file"),
            part_number=str,
            name=str,
            before=str,
            after=str,
            at=_described(str | None, "null between two frozen revisions"),
            username=str,
        )
    ),
)
Greeting = _shape("Greeting", url=str, token=str | None, login_url=str | None, database=str, public=bool)
Backup = _shape(
    "Backup",
    doc="Of ``backup`` and ``restore``; ``missing_files``: hashes that the server itself had lost.",
    format=int,
    schema_=str,
    made_at=str,
    database_sha256=str,
    rows=dict[str, int],
    files=int,
    missing_files=list[str],
)
Summaries = _shape("Summaries", assemblies=int)
Event = _shape("Event", doc="One line each, as they come.", id=str | None, type=str, event=str, data=Any)
Login = _shape("Login", url=str, username=str | None, role=str | None, configuration=str)
Found = _shape("Found", part_number=str, name=str, item_type=str)
ItemLine = _shape("ItemLine", part_number=str, name=str, quantity=float | None, source=str | None)
FoundItems = _shape("FoundItems", items=_many(Found), total=int)
Commands = _shape("Commands", items=list[str], total=int)
Shown = _shape("Shown", base=Found, current_revision=int, page=str, bom=_many(ItemLine))
Whoami = _shape("Whoami", url=str, from_=str, username=str | None, role=str | None)
Logout = _shape("Logout", configuration=str, removed=bool)
Addon = _shape("Addon", freecad=str, addon=str, packages=str)
Doctor = _shape(
    "Doctor",
    doc="Besides ``ok`` what was looked at, each with what was found, or what is wrong with it.",
    base=_Open,
    ok=bool,
)
LinkParts = _shape("LinkParts", parts=list[str])
LinkMap = _shape(
    "LinkMap",
    doc="As the YAML, without its comments; ``silo-mod inertia --links`` reads both.",
    links=GenericAlias(dict, (str, LinkParts)),
)


Imported = _shape(
    "Imported",
    doc="What became, or with ``--check`` would become, of each row of a table; ``items`` is that of prices.",
    dry_run=bool,
    counts=(dict[str, int], {}),
    problems=(_many(str), []),
    unused_columns=_many(str),
    notes=_many(str),
    missing=(_many(dict[str, str]), []),
    removed=(_described(int | _many(str), "lines of a BOM, or the codes of categories"), 0),
    kept=(_described(_many(str), "categories that items are of"), []),
    left_out=(_many(dict[str, Any]), []),
    rows=(_many(dict[str, Any]), []),
    items=(_many(dict[str, Any]), []),
    import_=(_described(int | None, "its number, for --undo"), None),
)
Undone = _shape(
    "Undone", doc="Of ``import --undo``.", kind=str, file=str, import_=_described(int, "its number")
)

SHAPES: dict[str, Any] = {
    "bom": Bom | FolderBoms | Witnessed | _many(FlatLine),
    "diff": Comparison,
    "bom-diff": BomDiff,
    "where-used": WhereUsed,
    "relink": Relinked,
    "sync": Sync,
    "register": Registered | Undeclared | Answered | Orphans | Archived,
    "commit": Committed,
    "status": ProjectStatus,
    "pull": Pulled,
    "log": Log | Changed,
    "queue": Queue,
    "search": FoundItems,
    "show": Shown,
    "order": OrderList,
    "import": Imported | Undone,
    "whoami": Whoami,
    "logout": Logout,
    "serve": Greeting,
    "backup": Backup,
    "restore": Backup,
    "summaries": Summaries,
    "watch": Event,
    "doctor": Doctor,
    "login": Login,
    "install-addon": Addon,
    "links": LinkMap,
    "schema": Commands,
}

NAMES = (*SHAPES, "inertia", "mass")
