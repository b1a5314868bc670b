# SPDX-License-Identifier: LGPL-2.1-or-later
"""Carry out what a person ordered: items on the server, identities in the files.

How an identity gets into a file is the caller's: FreeCAD writes into open documents, the command line into
files.

Registering the components of files that no FreeCAD has open: from the command line, and by the demo.

What is to be registered as a table that people edit: CSV out, CSV in, orders or all that is wrong with it.

The columns ``register``, ``name``, ``source``, ``supplier``, ``supplier_number``, ``type``, ``category`` and
``part_number`` are the person's; the others
say which component a row is, and how its file was when the table was written.
"""

from __future__ import annotations

import csv
import io
import os
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from silo.bom.document import relative
from silo.bom.errors import DocumentError, InputError, NotFoundError, SiloError
from silo.bom.findings import Finding
from silo.bom.headers import plain_cell, safe_cell
from silo.bom.items.categories import proposed_category
from silo.bom.items.proposal import Proposal, propose_all
from silo.bom.model import BomEntry, Extraction
from silo.bom_sync import resolve
from silo.fcstd import check_stampable, stamp
from silo.freecads import OpenInFreecad, open_in_any
from silo.registering.items import (
    Ask,
    Journal,
    Registration,
    RegistrationApi,
    begun_beside,
    component_key,
    on_disk,
    register,
    register_standard,
    unclear,
)
from silo.registering.offer import (
    ITEM_TYPES,
    Candidate,
    CandidateFiles,
    ComponentState,
    Learnt,
    LearntChoice,
    Modelled,
    Offer,
    OpenedFile,
    RegisterControl,
    Similar,
    fingerprint,
    source_identity,
)
from silo.workbook import unicode_name

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.vault.plan import Plan
    from silo.vault.reading import VaultReader


# What a person may change of a proposal.
CHOSEN = ("name", "item_type", "category", "sourcing", "supplier", "supplier_part_number")


@dataclass(frozen=True)
class Order:
    """A row that is to be registered, as the person left it.

    existing
        item to join instead of making a new one.
    apart
        of equal copies that are modelled in the file, each gets an item of its own.
    sourcing
        "manufactured" or "purchased"; "" while nobody has said.
    """

    candidate: Candidate
    name: str
    item_type: str
    category: str
    existing: Similar | None = None
    apart: bool = False
    sourcing: str = ""
    supplier: str = ""
    supplier_part_number: str = ""

    @classmethod
    def of(cls, candidate: Candidate) -> Order:
        """Make an order of a candidate, as it was proposed."""
        return cls(candidate, **{name: getattr(candidate.proposal, name) for name in CHOSEN})

    @property
    def proposal(self) -> Proposal:
        return replace(self.candidate.proposal, **{name: getattr(self, name) for name in CHOSEN})

    @property
    def teaches(self) -> bool:
        """Return True if a person chose something that is proposed for the next part with such a name."""
        before, entry = self.candidate.proposal, self.candidate.entry
        changed = (self.category, self.sourcing) != (before.category, before.sourcing)
        return changed and not entry.is_standard and not entry.is_assembly and self.existing is None

    def retyped(self, item_type: str, categories: Mapping[str, str]) -> Order:
        """Change the type of the order; the category follows if it is one that was proposed.

        categories
            code → description, as the schema has them.
        """

        def proposed(kind: str) -> str:
            entry = replace(self.candidate.entry, is_assembly=kind == "assembly")
            return proposed_category(entry, self.name, categories).code

        follows = self.category in (self.candidate.proposal.category, proposed(self.item_type))
        return replace(self, item_type=item_type, category=proposed(item_type) if follows else self.category)


# Writes an identity into the component's document and saves it: (candidate, identity).
Write = Callable[[Candidate, str], None]
# Raises DocumentError if that could not be done, before anything is made on the server.
Check = Callable[[Candidate], None]
# Which of the items that fit an interrupted run made: one of them, or None for a new item.
AskOrder = Callable[[Order, Proposal, Sequence[Mapping[str, Any]]], Mapping[str, Any] | None]


def seen_before(order: Order, proposal: Proposal, matches: Sequence[Mapping[str, Any]]) -> None:
    """Allow a new item if the person saw all these items in the dialog and took none of them. Raises
    ConflictError otherwise.
    """
    shown = {similar.item_id for similar in order.candidate.similar}
    if not all(str(item["id"]) in shown for item in matches):
        unclear(proposal, matches)


def carry_out(
    orders: Sequence[Order],
    api: RegistrationApi,
    journal: Journal,
    write: Write,
    *,
    schema: str,
    control: RegisterControl,
    done: Callable[[Order, Registration], object],
    check: Check = lambda _candidate: None,
    ask: AskOrder = seen_before,
) -> None:
    """Register one component after another; ``done`` is called with each result. Worker.

    One item's failure does not stop the rest. An error that concerns all items does: a token that is not
    accepted, a server that is gone or busy (:mod:`silo.api.policy`).
    """
    from silo.api.policy import ends_run

    gone: SiloError | None = None
    run = _OrderRun(api, journal, write, schema, check, ask, control)
    learnt = []
    for number, order in enumerate(orders):
        control.check()
        control.progress(order.name, number / len(orders))
        result = Registration(order.proposal, error=gone) if gone is not None else run.one(order)
        gone = result.error if result.error is not None and ends_run(result.error, api) else None
        done(order, result)
        if result.error is None and order.teaches:
            choice = LearntChoice((), order.category, order.sourcing, order.supplier)
            learnt.append((order.candidate.entry, order.candidate.proposal.name, choice))
    if learnt:
        Learnt().learn(learnt)


def take_back(
    done: Sequence[tuple[Order, Registration]],
    api: RegistrationApi,
    journal: Journal,
    restore: Callable[[Candidate], None],
    *,
    control: RegisterControl,
    back: Callable[[Order, SiloError | None], object],
) -> None:
    """Undo registrations, the last one first: files as they were before, and new items archived. Worker.

    restore
        gives a component's file the identity that it had before, or none.
    back
        called with each order, and with the error that kept it from being undone.

    The items of standard parts stay, because other projects have them too. Items with identities of another
    server, which the files had before, stay as well.
    """
    for number, (order, result) in enumerate(reversed(done)):
        control.check()
        control.progress(order.name, number / len(done))
        candidate = order.candidate
        if candidate.entry.is_standard or candidate.foreign:
            continue
        error = None
        try:
            restore(candidate)
            journal.forget(component_key(candidate.entry))
            for part_number in (result.part_number or "").split(", ") if not result.found else ():
                api.archive_item(part_number)
        except SiloError as problem:
            error = problem
        back(order, error)


@dataclass(frozen=True)
class _OrderRun:
    api: RegistrationApi
    journal: Journal
    write: Write
    schema: str
    check: Check
    ask: AskOrder
    control: RegisterControl

    def one(self, order: Order) -> Registration:
        candidate = replace(order.candidate, proposal=order.proposal)
        if candidate.entry.is_standard:
            return register_standard(order.proposal, self.api, schema=self.schema)
        if order.existing is not None:
            return self._join(candidate, order.existing.part_number, order.existing.item_id)
        if candidate.article is not None:
            return self._declare(order, candidate.article)
        return self._register(order, candidate)

    def _register(self, order: Order, candidate: Candidate) -> Registration:
        return register(
            candidate.proposal,
            self.api,
            self.journal,
            lambda entry, identity: self.write(
                replace(candidate, proposal=replace(candidate.proposal, entry=entry)), identity
            ),
            schema=self.schema,
            properties={"file_sha256": candidate.sha256} if candidate.sha256 else None,
            check=lambda _entry: self.check(candidate),
            ask=lambda proposal, matches: self.ask(order, proposal, matches),
            copy=bool(candidate.same_as),
            tell=self.control.progress,
        )

    def _join(self, candidate: Candidate, number: str, item_id: str) -> Registration:
        try:
            self.check(candidate)
            self.write(candidate, item_id)
        except SiloError as error:
            return Registration(candidate.proposal, error=error)
        return Registration(candidate.proposal, part_number=number, item_id=item_id, found=True)

    def _declare(self, order: Order, article: Modelled) -> Registration:
        """Give all objects of an article one identity: that of the file from which it was imported, or of a
        new item.

        An error of one copy leaves the others as they are.
        """
        done = []
        for modelled in article.apart() if order.apart else (article,):
            entry: BomEntry = replace(modelled.entry, silo_uuid=None)
            name = f"{order.name} {entry.object_name}" if order.apart else order.name
            proposal = replace(order.proposal, entry=entry, name=name)
            candidate = replace(order.candidate, article=modelled, proposal=proposal)
            result = self._as_imported(candidate, modelled) or self._register(order, candidate)
            if result.error is not None:
                return replace(result, proposal=order.proposal)
            done.append(result)
        numbers = ", ".join(str(result.part_number) for result in done)
        return replace(done[0], proposal=order.proposal, part_number=numbers)

    def _as_imported(self, candidate: Candidate, article: Modelled) -> Registration | None:
        """Register with the identity of the file from which A2plus imported it; None if Silo has no such
        item.
        """
        try:
            identity = source_identity(article)
            item = self.api.get_item_by_uuid(identity) if identity else None
        except SiloError as error:
            return Registration(candidate.proposal, error=error)
        return None if item is None else self._join(candidate, str(item["part_number"]), str(item["id"]))


OPEN = (
    "it is open in FreeCAD, and saving it there would undo the registration. Close it there, or register it "
    "from there (Silo, Register Parts), then run this again; --even-if-open registers it anyway"
)


class _Nobody:
    """Nobody looks on."""

    def progress(self, detail: str = "", fraction: float | None = None) -> None:
        return

    def check(self) -> None:
        return


_NOBODY = _Nobody()


def whole_folder(
    plan: Plan, reading: VaultReader, base: str, *, hardware: bool = True
) -> tuple[Extraction, frozenset[str]]:
    """Read all components of a folder's assemblies, and the files that no assembly uses."""
    from silo.vault.reading import Question

    entries: dict[tuple[str, str], BomEntry] = {}
    findings: list[Finding] = []
    for node in (node for layer in plan.layers for node in layer):
        extraction = plan.extraction(node, reading)
        findings += extraction.findings
        for entry in (*extraction.entries, extraction.assembly):
            entries.setdefault(entry.key, replace(entry, children=()))
    used = {entry.doc_path for entry in entries.values()}  # a standard part's key has no file
    alone = [top for top in plan.tops if os.path.realpath(top) not in used and top not in plan.errors]
    for answer in reading.ask_many(Question(top, None, hardware) for top in alone):
        if isinstance(part := answer.found, Extraction):
            head = part.assembly
            entries.setdefault(head.key, replace(head, children=(), is_assembly=False))
    unused = frozenset(entry.doc_path for entry in entries.values()) - used
    head = BomEntry(base, object_name="", is_assembly=True, level=0)
    return Extraction(head, tuple(entries.values()), tuple(dict.fromkeys(findings))), unused


def seen_on_disk(paths: Iterable[str], *, even_if_open: bool) -> dict[str, OpenedFile]:
    """Find out how the files of components stand."""
    opened = None if even_if_open else open_in_any()
    return {path: OpenedFile(_state(path, opened)) for path in paths}


def _state(path: str, opened: OpenInFreecad | None) -> ComponentState:
    if not os.path.isfile(path):
        return ComponentState.MISSING
    if not os.access(path, os.W_OK):
        return ComponentState.READ_ONLY
    return ComponentState.ELSEWHERE if opened is not None and opened.has_file(path) else ComponentState.READY


def is_own(candidate: Candidate) -> bool:
    """Return True if the look-alike is the candidate's own item, made by a run that was interrupted or
    undone.
    """
    entry, component = candidate.entry, component_key(candidate.entry)
    uid = on_disk(entry)[0]
    record = Journal().find(component) or begun_beside(entry.doc_path, component, uid)
    if record is None:
        return False
    if candidate.foreign:
        return not record.finished and candidate.entry.silo_uuid in (record.wanted, record.item_id)
    return not record.finished or record.document_uid == uid


def carry_out_on_disk(
    orders: Sequence[Order],
    client: SiloClient,
    *,
    schema: str,
    ask: Ask = unclear,
    even_if_open: bool = True,
    done: list[Registration] | None = None,
    control: RegisterControl = _NOBODY,
) -> list[Registration]:
    """Register the components, and write their identities into the files; ``done`` grows with each.

    even_if_open
        also write files that a running FreeCAD has open; otherwise they are left alone, and are an error.
    """
    results: list[Registration] = [] if done is None else done

    def places(candidate: Candidate) -> list[tuple[str | None, str | None]]:
        """Return (the object that the identity is for, the object that gets the property), each once."""
        if candidate.article is not None:
            return [(name, name) for name in candidate.article.objects]
        name = candidate.entry.object_name
        return [(name if candidate.shares_file else None, name or None)]

    def write(candidate: Candidate, identity: str) -> None:
        for own, item in places(candidate):
            again = bool(candidate.entry.silo_uuid)
            stamp(candidate.entry.doc_path, identity, object_name=own, item_object=item, replace=again)

    def check(candidate: Candidate) -> None:
        # Checked again for each file: people open files during a long run.
        if not even_if_open and open_in_any().has_file(candidate.entry.doc_path):
            raise DocumentError(candidate.entry.doc_path, OPEN)
        for own, item in places(candidate):
            again = bool(candidate.entry.silo_uuid)
            check_stampable(candidate.entry.doc_path, object_name=own, item_object=item, replace=again)

    carry_out(
        orders,
        client,
        Journal(),
        write,
        schema=schema,
        control=control,
        done=lambda _order, result: results.append(result),
        check=check,
        ask=lambda _order, proposal, items: ask(proposal, items),
    )
    return results


def proposals_for(extraction: Extraction, client: SiloClient, schema: str) -> list[Proposal]:
    """Propose items for the components without one, parts first; the assembly itself comes last."""
    wanted = resolve(extraction, client).unregistered
    tree = (extraction.assembly, *extraction.entries)
    return propose_all(wanted, tree, client.categories(schema)) if wanted else []


def register_all(
    proposals: Sequence[Proposal], client: SiloClient, *, schema: str, **more: Any
) -> list[Registration]:
    """Register these as they were proposed (:func:`carry_out_on_disk`)."""
    orders = [Order.of(Candidate(proposal, ComponentState.READY)) for proposal in proposals]
    return carry_out_on_disk(orders, client, schema=schema, **more)


COLUMNS = (
    *("register", "file", "object", "standard", "name", "source", "supplier", "supplier_number"),
    *("type", "category", "part_number", "note", "fingerprint"),
)
# A table need not have them.
_SUPPLY = ("source", "supplier", "supplier_number")
_AS_THEY_ARE = ("file", "object", "standard")
_AS_UTF_8 = "save the table as CSV (UTF-8)"
_ANSWERS = {"yes": True, "y": True, "no": False, "n": False}
SOURCES = {"": "", "made": "manufactured", "bought": "purchased"}
_FILES = {
    ComponentState.READ_ONLY: "the file is read-only",
    ComponentState.ELSEWHERE: "the file is open in FreeCAD",
    ComponentState.MISSING: "the file is missing",
}

# What a spreadsheet would take for a number, a date, a time or a truth: "00123" comes back as 123, "1E5" as
# 100000, "3-4" and "MAR1" as days. An apostrophe before it makes it text, as before a formula.
_MONTH = (
    "(?:jan|feb|fév|mar|mär|mrz|apr|abr|avr|may|mai|mag|jun|jui|giu|jul|lug|aug|aoû|ago|sep|set|oct|okt|ott|nov|"
    r"dec|dez|déc|dic|ene|gen)[^\W\d_]*"
)
_NO_TEXT = re.compile(
    r"'*(?:(?=\D*\d)[-+\d.,:/%$€ ]+(?:e[-+]?\d+)?(?: ?[ap]m?)?"
    rf"|\d{{1,4}}[-./ ]*{_MONTH}[-./ \d]*|{_MONTH}[-./ ]*\d{{1,4}}"
    r"|true|false|wahr|falsch|vrai|faux)",
    re.IGNORECASE,
)

# File and object, or the designation of a standard part.
Key = tuple[str, str]


def key_of(candidate: Candidate, base: str) -> Key:
    """Return the name of a component in a table."""
    entry = candidate.entry
    return ("", entry.standard) if entry.standard else (relative(entry.doc_path, base), entry.object_name)


def doubts(candidate: Candidate, earlier: CandidateFiles) -> list[str]:
    """List why a candidate may be an item already; ``earlier``: the candidates before it, which get their
    items first.
    """
    reasons = [
        f"Silo has this very file as {similar.part_number}"
        if similar.same_file
        else f"Silo has {similar.part_number} with the same name"
        for similar in candidate.similar
    ]
    if twin := earlier.twin(candidate):
        reasons.append(f"the same content as {twin.proposal.name}")
    if candidate.same_as:
        reasons.append(f"carries the identity of {candidate.same_as}, as another file does")
    if candidate.foreign:
        reasons.append("carries an identity of another server, or of another computer's run")
    return reasons


def remarks(candidate: Candidate, earlier: CandidateFiles) -> list[str]:
    """List what a person should know about a row."""
    texts = doubts(candidate, earlier)
    if candidate.proposal.is_guess:
        texts.append("the category is a guess")
    if candidate.learnt:
        texts.append("the category is the one chosen before in this folder")
    if candidate.article is not None:
        texts.append("modelled in the assembly's own file, not counted")
    if words := _FILES.get(candidate.state):
        texts.append(words)
    return texts


def write_table(offer: Offer, wanted: Callable[[Candidate], bool], base: str) -> bytes:
    """Write the table (RFC 4180, UTF-8 with the mark that spreadsheets need); ``wanted``: True for rows with
    ``yes``.
    """
    out = io.StringIO()
    writer = csv.DictWriter(out, COLUMNS)
    writer.writeheader()
    earlier = CandidateFiles()
    for candidate in offer.candidates:
        earlier.add(candidate)
        if candidate.decided:
            continue
        proposal, entry = candidate.proposal, candidate.entry
        row = {
            "register": "yes" if wanted(candidate) else "no",
            "file": relative(entry.doc_path, base),
            "object": entry.object_name,
            "standard": entry.standard or "",
            "name": proposal.name,
            "source": next(word for word, kind in SOURCES.items() if kind == proposal.sourcing),
            "supplier": proposal.supplier,
            "supplier_number": proposal.supplier_part_number,
            "type": proposal.item_type,
            "category": proposal.category,
            "part_number": "",
            "note": "; ".join(remarks(candidate, earlier)),
            "fingerprint": _fingerprint(candidate),
        }
        writer.writerow({column: _as_text(text) for column, text in row.items()})
    return b"\xef\xbb\xbf" + out.getvalue().encode("utf-8", "surrogateescape")


def _as_text(cell: str) -> str:
    return "'" + cell if _NO_TEXT.fullmatch(cell) else str(safe_cell(cell))


def _as_written(cell: str) -> str:
    """Return the text from which :func:`_as_text` made a cell."""
    return cell[1:] if cell.startswith("'") and _NO_TEXT.fullmatch(cell) else plain_cell(cell)


def _fingerprint(candidate: Candidate) -> str:
    """Return the fingerprint after a letter: a spreadsheet takes sixteen digits for a number, and
    rounds it.
    """
    checksum = "" if candidate.entry.is_standard else fingerprint(candidate.entry.doc_path)
    return checksum and f"x{checksum}"


@dataclass(frozen=True)
class TableRow:
    """One row of a table; ``line``: where it begins in the file (1 = first)."""

    line: int
    cells: Mapping[str, str]

    @property
    def key(self) -> Key:
        if standard := self.cells["standard"]:
            return "", standard
        return self.cells["file"], self.cells["object"]


def read_table(data: bytes, name: str) -> list[TableRow]:
    """Read the rows of a table, as a spreadsheet or an editor saved it. InputError lists all that is
    wrong.
    """
    text = _decoded(data, name)
    first = text.split("\n", 1)[0]
    delimiter = max(",;\t", key=first.count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    begins, problems, rows = 1, [], []
    header: list[str] | None = None
    try:
        for cells in reader:
            line, begins = begins, reader.line_num + 1
            if not any(cell.strip() for cell in cells):
                continue
            if header is None:
                header = [cell.strip().lower() for cell in cells]
                continue
            while len(cells) > len(header) and not cells[-1].strip():
                cells.pop()  # what a spreadsheet leaves behind on the right
            if len(cells) != len(header):
                problems.append(f"line {line}: wanted {len(header)} cells as in the header, got {len(cells)}")
                continue
            # The name of a file may begin with a space; a text that a person writes does not.
            row = dict.fromkeys(_SUPPLY, "")
            row |= {c: _as_written(t) for c, t in zip(header, cells, strict=True)}
            rows.append(TableRow(line, {c: t if c in _AS_THEY_ARE else t.strip() for c, t in row.items()}))
    except csv.Error as error:
        raise InputError(f"{name}: the row of line {begins} cannot be read as CSV: {error}") from None
    lacking = [column for column in COLUMNS if column not in (*(header or ()), *_SUPPLY)]
    if lacking:
        raise InputError(f"{name} is not a table of --plan: it has no column {', '.join(lacking)}")
    twice = sorted(column for column, count in Counter(header).items() if count > 1 and column)
    problems[:0] = [f"line 1: the column {column} is there more than once" for column in twice]
    if problems:
        raise InputError(f"{name} cannot be read; nothing was registered", problems)
    return rows


def _decoded(data: bytes, name: str) -> str:
    encoding = unicode_name(data) or "utf-8"
    if b"\0" in data and encoding == "utf-8":
        raise InputError(f"{name} is not a CSV file; save the table as CSV (UTF-8)")
    # Names of files may be no UTF-8; any other text that is none is a problem of its row.
    return data.decode(encoding, "replace" if "16" in encoding else "surrogateescape")


@dataclass(frozen=True)
class Planned:
    """What a table means now.

    done
        rows whose component has its number by now.
    unlisted
        components without a number that the table does not know.
    """

    orders: tuple[Order, ...]
    done: int
    unlisted: tuple[Candidate, ...]


def orders_of(rows: Sequence[TableRow], offer: Offer, base: str, api: Any, name: str) -> Planned:
    """Make the orders of a table. InputError lists all problems with their lines; then nothing is
    registered.
    """
    candidates = {
        key_of(component, base): component for component in offer.candidates if not component.decided
    }
    registered = {(relative(path, base), obj): number for (path, obj), number in offer.registered.items()}
    counts = Counter(row.key for row in rows)
    problems: list[str] = []
    orders = []
    joined: dict[str, list[Order]] = {}
    done = 0
    for row in rows:
        order_problems: list[str] = []
        wanted = _ANSWERS.get(row.cells["register"].lower())
        if wanted is None:
            order_problems.append(f"register: wanted yes or no, got {row.cells['register']!r}")
        if counts[row.key] > 1:
            order_problems.append("the component is there more than once")
        candidate = candidates.get(row.key)
        if candidate is not None and wanted:
            orders.append(order := _order(row, candidate, offer, api, order_problems))
            if order is not None and order.existing is not None:
                order_problems += _joined_before(order, joined.setdefault(order.existing.item_id, []))
        elif candidate is None and row.key in registered and wanted:
            done += 1
        elif candidate is None and wanted:
            what = row.cells["standard"] or f"{row.cells['file']}#{row.cells['object']}"
            hint = "" if what.isprintable() else f"; {_AS_UTF_8}"
            order_problems.append(f"{what} is no component here{hint}")
        problems += [f"line {row.line}: {words}" for words in order_problems]
    if problems:
        raise InputError(f"{name}: nothing was registered, because some rows have problems", problems)
    listed = {row.key for row in rows}
    unlisted = tuple(
        component
        for key, component in candidates.items()
        if key not in listed and component.article is None and not component.same_as
    )
    return Planned(tuple(order for order in orders if order is not None), done, unlisted)


def _order(
    row: TableRow, candidate: Candidate, offer: Offer, api: Any, order_remarks: list[str]
) -> Order | None:
    cells = row.cells
    before = len(order_remarks)
    order_remarks += filter(None, [wrong_name(cells["name"], candidate)])
    if cells["source"] not in SOURCES:
        order_remarks.append(f"source: wanted made, bought or nothing; got {cells['source']!r}")
    elif cells["source"] != "bought" and (cells["supplier"] or cells["supplier_number"]):
        order_remarks.append(
            "source: a part with a supplier is bought; say bought, or leave the supplier empty"
        )
    if cells["type"] not in ITEM_TYPES:
        order_remarks.append(f"type: wanted {', '.join(ITEM_TYPES)}; got {cells['type']!r}")
    if cells["category"] not in offer.categories:
        order_remarks.append(
            f"category: there is no {cells['category']!r}; there are {', '.join(offer.categories)}"
        )
    if not candidate.state.usable or candidate.state is ComponentState.ELSEWHERE:
        order_remarks.append(f"{cells['file']}: {_FILES.get(candidate.state, 'the file cannot be written')}")
    elif cells["fingerprint"] not in ("", _fingerprint(candidate)):
        order_remarks.append(
            f"{cells['file']} has changed since the table was written; look at it, write a new one"
        )
    existing = None
    if number := cells["part_number"]:
        try:
            existing = find_item(number, candidate, api)
        except InputError as error:
            order_remarks.append(f"part_number: {error}")
    if len(order_remarks) > before:
        return None
    supply = (SOURCES[cells["source"]], cells["supplier"], cells["supplier_number"])
    return Order(candidate, cells["name"], cells["type"], cells["category"], existing, False, *supply)


def _joined_before(order: Order, earlier: list[Order]) -> list[str]:
    """Find a number that was copied down a column, which would make one item of several parts."""
    others = [other for other in earlier if other.candidate.sha256 != order.candidate.sha256]
    earlier.append(order)
    number = order.existing.part_number if order.existing else ""
    return [
        f"part_number: {number} is already for {other.name!r} above, another file; "
        "register one of them with it"
        for other in others[:1]
    ]


def wrong_name(name: str, candidate: Candidate) -> str:
    """Say what is wrong with an item's name; "" if nothing is."""
    if not name:
        return "name: it is empty"
    if candidate.entry.standard and name != candidate.entry.standard:
        return f"name: a standard part is called by its designation, {candidate.entry.standard}"
    try:
        name.encode("utf-8")
    except UnicodeEncodeError:
        return f"name: {name!r} is no UTF-8; {_AS_UTF_8}"
    if "\ufffd" in name:
        return f"name: {name!r} has lost letters (\ufffd); {_AS_UTF_8}"
    if len(name) > 200 or not name.isprintable():
        return f"name: wanted one line of at most 200 characters that can be seen, got {name[:50]!r}"
    return ""


def find_item(number: str, candidate: Candidate, api: Any) -> Similar:
    """Find the item that a component joins. InputError if it cannot."""
    if candidate.entry.is_standard:
        raise InputError("a standard part has its item by its designation; leave this empty")
    try:
        item = api.get_item(number)
    except NotFoundError:
        raise InputError(f"there is no item {number}; leave it empty for a new one") from None
    if (item.item_type == "assembly") != (candidate.proposal.item_type == "assembly"):
        raise InputError(f"{number} is an item of type {item.item_type}; the file holds another type")
    return Similar(item.part_number, item.id, item.name)
