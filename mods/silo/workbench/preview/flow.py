# SPDX-License-Identifier: LGPL-2.1-or-later
"""From the command to the preview window, and from its buttons to the workers. GUI thread.

The BOM preview as rows: the assembly against the server, level by level (the rows of ``silo-mod diff``).

Pure, but for :func:`ask`, which reads from the server and belongs in the worker.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Protocol

from silo.bom.compare.bom_diff import BomDiff
from silo.bom.document import relative
from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import SiloError
from silo.bom.findings import Finding, FindingCode, Severity
from silo.bom.items.naming import display_name
from silo.bom.view.folders import shorten
from silo.outbox.entry import new_key
from silo.workbench.commit.flow import CommitFlow, commit_of
from silo.workbench.documents.snapshot import Snapshot
from silo.workbench.preview.desk import PreviewDesk
from silo.workbench.session.session import Session
from silo.workbench.session.worker import Control
from silo.workbench.words import MOST_TIP, counted, plain, quantity, spoken, translate

if TYPE_CHECKING:
    from silo.bom.key import Key
    from silo.bom_sync.resolved import Resolved


# Letters of a cell; its tool tip has the rest.
MOST_CELL = 300


class RowKind(StrEnum):
    """What a row says."""

    ADDED = "added"
    CHANGED = "changed"
    CONFLICT = "conflict"
    UNREFERENCED = "unreferenced"
    MANUAL = "manual"
    UNCHANGED = "unchanged"
    UNREGISTERED = "unregistered"
    MISSING = "missing"
    NOT_COUNTED = "not counted"
    GROUP = "group"


@dataclass(frozen=True)
class PreviewRow:
    """One row of the table.

    cad, silo
        quantities per one parent, as text; "" where that side has none.
    document, objects
        the instances in the CAD model, to select them.
    assembly, parts
        the assembly in that document, and what the row counts in it, to say why so many.
    """

    kind: RowKind
    number: str = ""
    name: str = ""
    cad: str = ""
    silo: str = ""
    note: str = ""
    document: str = ""
    objects: tuple[str, ...] = ()
    assembly: str = ""
    parts: tuple[Key, ...] = ()
    children: tuple[PreviewRow, ...] = ()

    def __post_init__(self) -> None:
        for text, most in (("number", MOST_CELL), ("name", MOST_CELL), ("note", MOST_TIP)):
            object.__setattr__(self, text, plain(getattr(self, text), most))


@dataclass(frozen=True)
class Compared:
    """One assembly against the server's lines.

    to_send
        a sync of it would be sent: the server has something to learn from it.
    """

    resolved: Resolved
    lines: tuple[Mapping[str, Any], ...]
    diff: BomDiff
    to_send: bool

    @property
    def is_new(self) -> bool:
        """Return True if a sync would send it, and the server has no line of it yet."""
        return self.to_send and not self.lines


@dataclass(frozen=True)
class Preview:
    """All that the preview shows, and what a sync from it needs.

    compared
        every assembly, children before parents; the one that was asked for is the last.
    broken
        what keeps the assembly from being synced.
    page
        address of the assembly's BOM on the server.
    note
        why it was made, where nobody asked for it.
    """

    snapshot: Snapshot
    compared: tuple[Compared, ...]
    names: Mapping[str, str] = field(default_factory=dict)
    broken: tuple[Finding, ...] = ()
    page: str = ""
    note: str = ""

    @property
    def top(self) -> Compared:
        return self.compared[-1]

    @property
    def number(self) -> str:
        """Return the part number of the assembly; "" while it has none."""
        return self.top.resolved.assembly.part_number or ""

    @property
    def unregistered(self) -> tuple[BomEntry, ...]:
        """Return the components without a part number, the assembly itself included."""
        return self.top.resolved.unregistered

    @property
    def movable(self) -> tuple[Finding, ...]:
        """Return the broken links for which exactly one file fits."""
        return tuple(finding for finding in self.broken if finding.did_you_mean)

    @property
    def to_send_below(self) -> int:
        """Count the sub-assemblies for which a sync has something to send."""
        return sum(1 for compared in self.compared[:-1] if compared.to_send)


def ask(snapshot: Snapshot, api: Any, control: Control) -> Preview:
    """Compare a snapshot with the server, sub-assemblies included. Worker."""
    from silo.batch import suggest_by_identity
    from silo.bom_sync.resolved import assemblies, blocking, names_of, resolve
    from silo.bom_sync.steps import server_lines
    from silo.fcstd.suggest import with_suggestions

    extraction = snapshot.extraction or Extraction(BomEntry(snapshot.path, label=snapshot.label))
    extraction = with_suggestions(extraction)
    whole = resolve(extraction, api)
    lines = []
    for assembly in assemblies(whole):
        control.check()
        control.progress(assembly.assembly.part_number or assembly.assembly.label)
        lines.append(server_lines(assembly, api))
    whole = suggest_by_identity(whole, list(zip(assemblies(whole), lines, strict=True)))
    compared = [_compared(resolved, other) for resolved, other in zip(assemblies(whole), lines, strict=True)]
    all_lines = [line for pair in compared for line in pair.lines]
    number = whole.assembly.part_number
    page = api.web_url(f"/items/{number}/bom") if number else ""
    return Preview(snapshot, tuple(compared), names_of(whole, all_lines), blocking(whole), page)


def _compared(resolved: Resolved, lines: tuple[Mapping[str, Any], ...]) -> Compared:
    from silo.bom_sync.steps import Status, decide

    # Whether what is missing may be left out is asked in the window, so it does not count here.
    outcome = decide(resolved, lines, allow_missing=True)
    diff = resolved.diff(lines) if outcome.plan is None else outcome.plan.diff
    return Compared(resolved, lines, diff, outcome.status is Status.MERGED)


# Nested assemblies share their lines: some dozen small files can stand for more rows than memory holds.
MOST_ROWS = 3000


def rows(preview: Preview, most: int = MOST_ROWS) -> tuple[PreviewRow, ...]:
    """Make the table: the lines of the assembly, then what is left out and why.

    most
        the most rows of sub-assemblies; each sub-assembly gets its share, and one row sums up the rest.
    """
    by_key = {compared.resolved.assembly.key: compared for compared in preview.compared}
    base = os.path.dirname(preview.snapshot.path)
    room = most // 2
    table = [*_assembly_rows(preview.top, by_key, preview.names, frozenset(), room)]
    unresolved = preview.top.resolved.unresolved
    share = _share(room, unresolved)
    unregistered = tuple(
        _unregistered_row(entry, preview, tuple(_below(entry, by_key, preview.names, frozenset(), share)))
        for entry in unresolved
    )
    if unregistered:
        title = translate("Silo", "Without a part number: left out until registered")
        table.append(_group(title, unregistered))
    left_out = tuple(
        _finding_row(f, preview, base)
        for f in sorted(
            (f for f in preview.top.resolved.findings if f.code not in _ELSEWHERE),
            key=lambda f: _ORDER[f.severity],
        )
    )
    if left_out:
        title = translate("Silo", "Not counted, or counted with a remark")
        table.append(_group(title, left_out))
    return tuple(table)


def _group(title: str, children: tuple[PreviewRow, ...]) -> PreviewRow:
    return PreviewRow(RowKind.GROUP, name=f"{title} ({len(children)})", children=children)


Known = Mapping[tuple[str, str], Compared]
Keys = frozenset[tuple[str, str]]


def _share(room: int, entries: Sequence[BomEntry]) -> int:
    return room // max(1, sum(entry.is_assembly for entry in entries))


def _assembly_rows(
    compared: Compared, lines: Known, names: Mapping[str, str], above: Keys, room: int
) -> Iterator[PreviewRow]:
    """Yield the assembly's own lines in its own order, then those that only the server has.

    room
        how many rows may be below them.
    """
    states = _states(compared.diff)
    share = _share(room, compared.resolved.entries)
    above = above | {compared.resolved.assembly.key}
    for entry in compared.resolved.entries:
        kind, silo, note = states.get(entry.part_number or "", (RowKind.UNCHANGED, "", ""))
        if (own := lines.get(entry.key)) is not None and entry.is_assembly and entry.part_number:
            note = "; ".join(filter(None, (note, _own_words(own))))
        if entry.missing:
            file = relative(entry.doc_path, os.path.dirname(compared.resolved.assembly.doc_path))
            file += f"#{entry.object_name}" if entry.object_name else ""
            kind, note = RowKind.MISSING, translate("Silo", "missing: {file}", file=file)
        yield PreviewRow(
            kind,
            number=entry.part_number or "",
            name=entry.name or (display_name(entry) if entry.missing else ""),
            cad=quantity(entry.quantity),
            silo=silo,
            note=note,
            **_counted(entry, compared.resolved.assembly),
            children=tuple(_below(entry, lines, names, above, share)),
        )
    local = {entry.part_number for entry in compared.resolved.entries}
    for kind, changes in (
        (RowKind.UNREFERENCED, compared.diff.removed),
        (RowKind.MISSING, compared.diff.kept),
        (RowKind.MANUAL, compared.diff.manual),
    ):
        for change in changes:
            if change.part_number not in local:
                number, amount = change.part_number, quantity(change.quantity)
                name = names.get(number, "")
                yield PreviewRow(kind, number=number, name=name, silo=amount, note=_notes()[kind])


def _below(
    entry: BomEntry, lines: Known, names: Mapping[str, str], above: Keys, room: int
) -> Iterator[PreviewRow]:
    """Yield the lines of a sub-assembly; none if it is above itself (a finding reports the loop)."""
    compared = lines.get(entry.key) if entry.is_assembly and entry.key not in above else None
    if compared is None:
        return
    left = room - len(compared.resolved.entries) - len(compared.diff.removed) - len(compared.diff.manual)
    if left < 0:
        yield PreviewRow(RowKind.GROUP, name=translate("Silo", "… more rows than can be shown here"))
    else:
        yield from _assembly_rows(compared, lines, names, above, left)


def _states(diff: BomDiff) -> dict[str, tuple[RowKind, str, str]]:
    """Return part number → kind, the server's quantity, and what a sync does."""
    notes = _notes()
    states: dict[str, tuple[RowKind, str, str]] = {}
    for line in diff.unchanged:
        states[line.part_number] = (RowKind.UNCHANGED, quantity(line.quantity), "")
    for line in diff.added:
        states[line.part_number] = (RowKind.ADDED, "", notes[RowKind.ADDED])
    for change in diff.quantity_changed:
        states[change.part_number] = (
            RowKind.CHANGED,
            quantity(change.remote_quantity),
            notes[RowKind.CHANGED],
        )
    for change in diff.conflicts:
        kept = change.on_server(quantity(change.remote_quantity))
        states[change.part_number] = (RowKind.CONFLICT, kept, notes[RowKind.CONFLICT])
    for line in diff.kept:
        states[line.part_number] = (RowKind.MISSING, quantity(line.quantity), notes[RowKind.MISSING])
    return states


def _notes() -> dict[RowKind, str]:
    return {
        RowKind.ADDED: translate("Silo", "new in the assembly: will be added"),
        RowKind.CHANGED: translate("Silo", "will take the assembly's quantity"),
        RowKind.CONFLICT: translate(
            "Silo", "manual line in Silo with another quantity: a person decides there"
        ),
        RowKind.UNREFERENCED: translate("Silo", "not in the assembly: kept, marked unreferenced"),
        RowKind.MANUAL: translate("Silo", "manual line: not touched"),
        RowKind.MISSING: translate("Silo", "its file is missing: the line stays as it is"),
    }


def _own_words(compared: Compared) -> str:
    """Say if the BOM of a sub-assembly is in Silo."""
    if compared.is_new:
        return translate("Silo", "its own BOM is not in Silo yet")
    return translate("Silo", "its own BOM differs from Silo") if compared.to_send else ""


def _unregistered_row(entry: BomEntry, preview: Preview, children: tuple[PreviewRow, ...]) -> PreviewRow:
    head = preview.top.resolved.assembly
    return PreviewRow(
        RowKind.UNREGISTERED,
        name=display_name(entry),
        cad=quantity(entry.quantity),
        note=relative(entry.doc_path, os.path.dirname(preview.snapshot.path)),
        children=children,
        **(_counted(entry, head) if entry.level == head.level + 1 else {}),
    )


def _counted(entry: BomEntry, head: BomEntry) -> dict[str, Any]:
    """Return the fields of a row for an entry of the model, directly below an assembly."""
    return {
        "document": head.doc_path,
        "objects": entry.instances,
        "assembly": head.object_name,
        "parts": (entry.key, *entry.also),
    }


# Shown as separate rows.
_ELSEWHERE = (FindingCode.UNREGISTERED,)
_ORDER = {Severity.ERROR: 0, Severity.WARNING: 1, Severity.INFO: 2}


def _finding_row(finding: Finding, preview: Preview, base: str) -> PreviewRow:
    top = preview.snapshot.path
    mine = tuple(place.obj for place in finding.where if place.doc_path == top and place.obj)
    return PreviewRow(
        RowKind.NOT_COUNTED,
        number={Severity.ERROR: "✗", Severity.WARNING: "⚠", Severity.INFO: "·"}[finding.severity],
        note=spoken(shorten(finding.message, base)),
        document=top if mine else "",
        objects=mine,
    )


def summary(preview: Preview) -> str:
    """Write the line above the table."""
    diff = preview.top.diff
    parts = (
        (len(diff.added), translate("Silo", "{n} to add")),
        (len(diff.quantity_changed), translate("Silo", "{n} with another quantity")),
        (len(diff.removed), translate("Silo", "{n} unreferenced")),
        (len(diff.conflicts), translate("Silo", "{n} in conflict")),
        (len(preview.top.resolved.unresolved), translate("Silo", "{n} without a part number")),
        (sum(entry.missing for entry in preview.top.resolved.entries), translate("Silo", "{n} missing")),
    )
    texts = [text.replace("{n}", str(count)) for count, text in parts if count]
    new = sum(compared.is_new for compared in preview.compared[:-1])
    below = [
        counted(count, singular, many)
        for count, singular, many in (
            (
                new,
                translate("Silo", "{n} sub-assembly is not in Silo yet"),
                translate("Silo", "{n} sub-assemblies are not in Silo yet"),
            ),
            (
                preview.to_send_below - new,
                translate("Silo", "{n} sub-assembly differs from Silo"),
                translate("Silo", "{n} sub-assemblies differ from Silo"),
            ),
        )
        if count
    ]
    agreeing = len(diff.unchanged)
    if texts:
        own = ", ".join(texts)
    elif below:
        own = counted(agreeing, translate("Silo", "{n} line agrees"), translate("Silo", "{n} lines agree"))
    else:
        own = translate("Silo", "Nothing to sync: all {n} lines agree with Silo.", n=agreeing)
    return "; ".join((own, *below))


def to_sync(preview: Preview, *, below: bool) -> tuple[Snapshot, ...]:
    """Return the snapshots whose BOMs a sync sends, children before parents; without ``below`` only the top
    one.
    """
    snapshots = []
    for compared in preview.compared[:-1] if below else ():
        if compared.to_send:
            snapshots.append(_part_of(preview.snapshot, compared.resolved))
    return (*snapshots, preview.snapshot)


def _part_of(snapshot: Snapshot, resolved: Resolved) -> Snapshot:
    """Cut the snapshot of a sub-assembly from that of its parent."""
    head = resolved.assembly
    original = _find(snapshot.extraction, head.key)
    mine = tuple(f for f in resolved.findings if any(place.doc_path == head.doc_path for place in f.where))
    return Snapshot(
        path=head.doc_path,
        label=display_name(head),
        identity=head.silo_uuid,
        extraction=Extraction(replace(head, children=()), original.children if original else (), mine),
    )


def _find(extraction: Extraction | None, key: tuple[str, str]) -> BomEntry | None:
    stack = list(extraction.entries) if extraction is not None else []
    seen = set()
    while stack:
        entry = stack.pop()
        if entry.key == key:
            return entry
        if id(entry) not in seen:
            seen.add(id(entry))
            stack.extend(entry.children)
    return None


# Of many sub-assemblies that differ, the first ones.
_MOST_ACCOUNTS = 4
# Of many ways to a part, the first ones; `silo-mod bom --why` prints all.
_MOST_WAYS = 12


class PreviewWindow(Protocol):
    """An open preview; :mod:`silo.workbench.preview.dialog` is the real one."""

    def busy(self) -> None: ...

    def fill(self, preview: Preview, /) -> None: ...

    def fail(self, error: SiloError, /) -> None: ...

    def tell_view(self, text: str, /, *, agrees: bool | None) -> None: ...

    def raise_(self) -> None: ...


class PreviewFlow:
    """Opens previews, one per document, and does what their buttons ask for.

    register, show, view
        what the add-on does for the window: register what a preview lists, select objects, open a page.
    """

    def __init__(
        self,
        session: Session,
        commits: CommitFlow,
        desk: PreviewDesk,
        *,
        register: Callable[[str], None],
        show: Callable[[str, tuple[str, ...]], None],
        view: Callable[[str], None],
        known: Callable[[str, Iterable[BomEntry]], None] = lambda _path, _entries: None,
    ) -> None:
        self._session, self._commits, self._desk = session, commits, desk
        self.register, self.show, self.view, self._known = register, show, view, known
        self._open: dict[str, PreviewWindow] = {}
        self._to_mend: set[str] = set()

    def start(self, doc: Any, *, mend: bool = False) -> None:
        """Compare a document's assembly with the server; ``mend``: first mend its broken links, if a file
        fits.
        """
        taken = self._take(doc)
        if taken is None:
            return
        if not taken.is_assembly:
            text = taken.problem or translate("Silo", "{name} holds no assembly, so it has no BOM.")
            self._desk.warn(translate("Silo", "BOM in Silo"), text.replace("{name}", taken.label))
            return
        self._dialog(taken, doc.Name)
        if mend:
            self._to_mend.add(taken.path)
        self._ask(taken)

    def again(self, path: str) -> None:
        """Compare again in an open window, since what it shows has changed."""
        if path in self._open and (taken := self._taken_again(path)) is not None:
            self._ask(taken)

    def _taken_again(self, path: str) -> Snapshot | None:
        """Take a new snapshot of the document of an open window; if the document is closed, the window says
        so.
        """
        doc = self._opened(path, path)
        return None if doc is None else self._take(doc)

    def _opened(self, path: str, window: str) -> Any:
        doc = self._desk.find(path)
        if doc is None:
            error = SiloError(
                translate(
                    "Silo",
                    "{name} is not open any more. Open it, then compare again.",
                    name=plain(os.path.basename(path), 80),
                )
            )
            self._with_dialog(window, lambda dialog: dialog.fail(error))
        return doc

    def _take(self, doc: Any) -> Snapshot | None:
        try:
            return self._commits.snapshot(doc)
        except SiloError as error:
            self._desk.warn(translate("Silo", "BOM in Silo"), str(error))
            return None

    def _dialog(self, taken: Snapshot, name: str) -> None:
        if taken.path in self._open:
            self._open[taken.path].raise_()
            return
        self._open[taken.path] = self._desk.preview_window(taken.label or name, taken.path, self)

    def closed(self, path: str) -> None:
        """Forget the closed window of this document."""
        self._open.pop(path, None)
        self._to_mend.discard(path)

    def _ask(self, taken: Snapshot, note: str = "") -> None:
        self._with_dialog(taken.path, lambda dialog: dialog.busy())

        self._session.ask(
            translate("Silo", "Comparing with Silo"),
            lambda client, control: replace(ask(taken, client, control), note=note),
            done=self._answered,
            failed=lambda error: self._with_dialog(taken.path, lambda dialog: dialog.fail(error)),
        )

    def _answered(self, preview: Preview) -> None:
        path = preview.snapshot.path
        self._known(path, preview.top.resolved.entries)
        self._with_dialog(path, lambda dialog: dialog.fill(preview))
        if path in self._to_mend:
            self._to_mend.discard(path)
            self.relink(preview)

    def _with_dialog(self, path: str, call: Callable[[PreviewWindow], None]) -> None:
        # The window may have been closed while the server was thinking.
        if path in self._open:
            call(self._open[path])

    def verify(self, preview: Preview) -> None:
        """Compare what FreeCAD shows with the present BOM, and select what no line explains."""
        path = preview.snapshot.path
        taken = self._taken_again(path)
        if taken is None or taken.extraction is None:
            return
        try:
            accounts = self._desk.accounts(taken.extraction)
        except SiloError as error:
            self._desk.warn(translate("Silo", "BOM in Silo"), str(error))
            return
        differing = [account for account in accounts if not account.agrees]
        lines = [account.sentence() for account in (differing or accounts[:1])[:_MOST_ACCOUNTS]]
        text = "\n".join(lines)
        self._with_dialog(path, lambda dialog: dialog.tell_view(text, agrees=not differing))
        unexplained = next((account for account in differing if account.unexplained), None)
        if unexplained is not None:
            self.show(unexplained.doc_path, unexplained.unexplained)

    def why(self, window: str, document: str, assembly: str, parts: Collection[Key]) -> None:
        """Show in a window each chain from an assembly to a part of it."""
        if (doc := self._opened(document, window)) is None:
            return
        try:
            lines = self._desk.why(doc, assembly, parts)
        except SiloError as error:
            lines = [str(error)]
        if (more := len(lines) - _MOST_WAYS) > 0:
            lines[_MOST_WAYS:] = [translate("Silo", "… and {n} more", n=more)]
        text = "\n".join(plain(line, MOST_CELL) for line in lines)
        self._with_dialog(window, lambda dialog: dialog.tell_view(text, agrees=None))

    def relink(self, preview: Preview) -> None:
        """Lead broken links to the files that were meant, if exactly one fits; then compare again."""
        try:
            mended = [label for finding in preview.movable for label in self._desk.relink(finding)]
        except SiloError as error:
            self._desk.warn(translate("Silo", "BOM in Silo"), str(error))
            mended = []
        if mended:
            self.again(preview.snapshot.path)

    def sync(self, preview: Preview, below: bool, allow_missing: bool) -> None:
        """Sync what is shown; ``below``: its sub-assemblies first; ``allow_missing``: with broken links.

        If the document was edited since, it is compared again instead, because its BOM and its file must be
        of the same state.
        """
        path = preview.snapshot.path
        now = self._taken_again(path)
        if now is None:
            return
        if not now.is_as(preview.snapshot):
            self._ask(
                now,
                translate(
                    "Silo",
                    "Nothing was synced: {name} was edited since the comparison. Here it is now.",
                    name=plain(now.label, 80),
                ),
            )
            return

        def failed(error: SiloError) -> None:
            self._with_dialog(path, lambda dialog: dialog.fail(error))

        for taken in to_sync(preview, below=below):
            commit = commit_of(taken, key=new_key(), allow_missing=allow_missing)
            if commit is None:
                continue
            try:
                commit = self._commits.made_from(commit, self._desk.find(taken.path))
            except SiloError as error:
                failed(error)
            else:
                self._session.keep(commit, failed=failed)
