# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOM lines for people: their changes in words, and their forms, with what others did meanwhile.

A form sends each field twice: as it stands now, and as it was shown. So only what the person changed is
written, whatever happened to the line since, and only a field that two people changed needs a choice.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from typing import Any

from starlette.datastructures import FormData

from silo.api.wire import LineTexts
from silo.bom.errors import RejectedError
from silo.bom.headers import designators
from silo.bom.numbers import read_quantity
from silo.bom.quantities import same_quantity
from silo.bom.units import counts_pieces
from silo_server.db.transaction import Tx
from silo_server.schema import text_hints
from silo_server.services.bom import history
from silo_server.services.bom.conflicts import last_cad_quantities
from silo_server.services.bom.decisions import Decision, ReviewAction
from silo_server.services.bom.history import Change, ChangedLine
from silo_server.services.bom.line_record import ChangeKind
from silo_server.services.bom.review import Review
from silo_server.values import Item, Line, LineState
from silo_server.web.forms import Edit, amount, compared, same_text, text, texts, whole
from silo_server.web.render import N_, _, isolate, plural, quantity

TEXTS = LineTexts.model_fields
# What a user fills in on a line, with its label.
FIELDS = {
    "quantity": N_("Quantity"),
    "reference_designators": N_("Reference designators"),
    **{name: field.title or name for name, field in TEXTS.items()},
}
_NAMES = {
    **{name: label.lower() for name, label in FIELDS.items() if name not in ("quantity", "unit")},
    "child_revision": N_("revision"),
    "rel_type": N_("type"),
}
MOST_TEXT = 10_000
MOST = {name: text_hints(field).get("maxLength", MOST_TEXT) for name, field in TEXTS.items()}
MOST["quantity"] = 100
# "6" and "m" mean something only together.
TOGETHER = (("quantity", "unit"),)
MINE, THEIRS = "mine", "theirs"
KEPT = N_("kept on purpose, not in the CAD model")
DONE = {
    ReviewAction.REMOVE: N_("removed"),
    ReviewAction.KEEP: N_("kept as intentional"),
    ReviewAction.TAKE_CAD: N_("set to what CAD says"),
    ReviewAction.KEEP_SILO: N_("left as Silo says"),
}


@dataclass(frozen=True)
class LineForm:
    """What came back from the form of a line.

    typed, seen
        its fields as they stand now, and as they were shown; those that were not sent are absent.
    picked
        first field of a group that clashed → ``mine`` or ``theirs``.
    asked
        the groups for which a choice was asked for.
    at
        the newest change of the BOM when the form was shown.
    """

    typed: Mapping[str, str] = field(default_factory=dict)
    seen: Mapping[str, str] = field(default_factory=dict)
    picked: Mapping[str, str] = field(default_factory=dict)
    asked: Sequence[str] = ()
    why: str = ""
    at: int = 0


def shown(state: LineState) -> dict[str, str]:
    """Write the fields of a line as its form shows them."""
    return {
        "quantity": quantity(state.quantity),
        "reference_designators": " ".join(state.reference_designators),
        **{name: getattr(state, name) or "" for name in TEXTS},
    }


def read(form: FormData) -> LineForm:
    """Read the form of a line; texts stay as they were typed."""
    typed = {name: _text(form, name) for name in FIELDS if name in form}
    if readings := _text(form, "quantity_is"):
        typed["quantity"] = readings  # the answer to "which of the two numbers?"
    return LineForm(
        typed,
        {name: _text(form, f"was_{name}") for name in FIELDS if f"was_{name}" in form},
        {name: _text(form, f"pick_{name}") for name in FIELDS if f"pick_{name}" in form},
        [name for name in _text(form, "asked").split() if name in FIELDS],
        text(form, "why"),
        whole(form, "at") or 0,
    )


def edit_of(sent: LineForm, now: LineState) -> Edit:
    """Find what the form changes on the line as it is now; RejectedError if a choice was not made."""
    if unmade(sent):
        names = ", ".join(_(FIELDS[name]) for name in unmade(sent))
        raise RejectedError(_("%(names)s: choose yours or theirs", names=names))
    typed = dict(sent.typed)
    for name, pick in sent.picked.items():
        if pick == THEIRS:
            for other in group_of(name):
                typed[other] = sent.seen.get(other, typed.get(other, ""))
    return compared(shown(now), sent.seen, typed, together=TOGETHER, same=_same)


def still_typed(typed: Mapping[str, str], seen: Mapping[str, str], now: Mapping[str, str]) -> dict[str, str]:
    """Make the fields of a refused form: what the person changed, else the line as it is now.

    The form is compared with ``now`` when it comes back, so an old text of a field that the person left alone
    would revert what others wrote there.
    """
    mine = {
        name
        for name, text in typed.items()
        if name not in seen or not _same(name, text, seen[name])
        for name in group_of(name)
    }
    return {**now, **{name: text for name, text in typed.items() if name in mine or name not in now}}


def unmade(sent: LineForm) -> list[str]:
    """List the fields for which a choice was asked for and not made."""
    names = [name for name in sent.asked if sent.picked.get(name) not in (MINE, THEIRS)]
    return [other for name in names for other in group_of(name)]


def group_of(name: str) -> Sequence[str]:
    """Return the fields that mean something only together with this one, itself among them."""
    return next((group for group in TOGETHER if name in group), (name,))


def values_of(texts: Mapping[str, str]) -> dict[str, Any]:
    """Read the texts of fields as values of a line; RejectedError if one is unusable."""
    values: dict[str, Any] = {}
    for name, written in texts.items():
        most = MOST.get(name, MOST_TEXT)
        if len(written) > most:
            raise RejectedError(
                _(
                    "%(name)s: wanted at most %(most)s characters, got %(count)s",
                    name=_(FIELDS[name]),
                    most=most,
                    count=len(written),
                )
            )
        if name == "quantity":
            values[name] = amount(written, _(FIELDS[name]))
        elif name == "reference_designators":
            values[name] = designators(written)
        else:
            values[name] = written or None
    return values


def decision_of(form: FormData) -> tuple[ReviewAction, str | None]:
    """Read what a form decides, and why; RejectedError if it has no button of ours."""
    try:
        action = ReviewAction(text(form, "action"))
    except ValueError:
        raise RejectedError(_("action: wanted one of the buttons, got none; load the page again")) from None
    return action, text(form, "reason") or (_(KEPT) if action is ReviewAction.KEEP else None)


def decisions_of(form: FormData, names: Mapping[str, str]) -> list[Decision]:
    """Read the decisions in a form: one for each line (by its id, or its child) in ``chosen``.

    names
        line id → part number, of the BOM's lines. After the id may stand the mark of what was seen.
    """
    action, reason = decision_of(form)
    decisions = []
    for value in texts(form, "chosen"):
        which, _space, seen = value.partition(" ")
        if seen:
            decisions.append(Decision(names.get(which, ""), action, reason, which, seen))
        else:
            line_id = which if which in names else None
            decisions.append(Decision(names.get(value, value), action, reason, line_id))
    return decisions


def meanwhile(tx: Tx, parent: Item, line_ids: Sequence[str], after: int) -> dict[str, list[str]]:
    """Describe what happened to lines after change ``after``, by line id, newest first."""
    return {
        line_id: [f"{_became(line)}, {by_whom(change)}" for change, line in story]
        for line_id, story in history.stories(tx, parent, line_ids, after).items()
    }


def disputed(
    tx: Tx, parent: Item, lines: Sequence[Line], review: Review
) -> tuple[dict[str, str], dict[str, str]]:
    """Describe who set quantities here, and what CAD says of these lines; both by line id."""
    cad_quantities = last_cad_quantities(tx, [parent.id]).get(parent.id, {})
    overrides = [line for line in lines if line.state.override]
    asked = {*(line.id for line in overrides), *(conflict.line.id for conflict in review.conflicts)}
    stories = history.stories(tx, parent, asked)
    by_hand = {line_id: who for line_id, story in stories.items() if (who := _quantity_by(story))}
    return (
        {line_id: by_whom(change) for line_id, change in by_hand.items()},
        {
            line.id: _cad_words(line, cad_quantities, by_hand.get(line.id), review.last_merge)
            for line in overrides
        },
    )


def _quantity_by(story: Sequence[tuple[Change, ChangedLine]]) -> Change | None:
    """Find the change in which a user gave a line its present quantity; None if a merge did."""
    for change, line in story:
        before = line.before.quantity if line.before else None
        if line.after is not None and line.after.quantity != before:
            return None if change.kind == ChangeKind.MERGE else change
    return None


def _cad_words(
    line: Line, quantities: Mapping[int, Decimal], by_hand: Change | None, merge: Change | None
) -> str:
    """Describe CAD's quantity for a line that a user changed; the conflict above it says the same."""
    if line.child_id in quantities:
        cad_quantity = quantities[line.child_id]
        return (
            _("CAD says %(quantity)s", quantity=of_cad(cad_quantity, line.unit))
            if cad_quantity
            else _("CAD no longer has it")
        )
    if merge is not None and by_hand is not None and merge.id > by_hand.id:
        return _("CAD says the same")
    return _("CAD said %(quantity)s before", quantity=of_cad(line.state.cad_quantity, line.unit))


def of_cad(count: Decimal | None, unit: str | None) -> str:
    """Write a quantity of CAD beside a line with this unit: ``6``, or ``6 pieces`` beside ``0.5 m``."""
    return quantity(count, unit if counts_pieces(unit) else _("piece") if count == 1 else _("pieces"))


def _became(line: ChangedLine) -> str:
    if line.before is None or line.after is None:
        return _("removed") if line.after is None else _("added")
    return ", ".join(changes(line.before, line.after)) or _("changed")


def _same(name: str, a: str, b: str) -> bool:
    if a == b:
        return True
    if name == "quantity":
        number, other = read_quantity(a).value, read_quantity(b).value
        return number is not None and other is not None and same_quantity(number, other)
    if name == "reference_designators":
        return designators(a) == designators(b)
    return same_text(a, b, lines=name in TEXTS and bool(text_hints(TEXTS[name]).get("long")))


def _text(form: FormData, name: str) -> str:
    """Read a field of any length: :func:`values_of` refuses a long one by the label that the page shows."""
    return text(form, name, sys.maxsize)


def by_whom(change: Change) -> str:
    """Describe who made a change: ``by ann, 2026-02-08 22:15: one spare``; a sync names its file."""
    values = {"user": isolate(change.username), "at": change.at[:16].replace("T", " ")}
    words = _(
        "sync by %(user)s, %(at)s" if change.kind == ChangeKind.MERGE else "by %(user)s, %(at)s", **values
    )
    if change.document_file:
        words += _(", from %(document_file)s", document_file=isolate(change.document_file))
    return f"{words}: {isolate(change.reason)}" if change.reason else words


def sentence(line: ChangedLine) -> tuple[str, str]:
    """Describe what a change made of a line: (mark, ``F01-0001 M8x20 Bolt: quantity 8 → 12``).

    The mark is ``added``, ``removed``, ``changed``, or ``warn`` if CAD lost the line.
    """
    who = f"{isolate(line.child.part_number)} {isolate(line.child.name)}".strip()
    if line.before is None and line.after is not None:
        shown = quantity(line.after.quantity, line.after.unit)
        return "added", _("%(who)s: added, quantity %(quantity)s", who=who, quantity=shown)
    if line.after is None:
        return "removed", _("%(who)s: removed", who=who)
    assert line.before is not None  # a changed line has both states
    gone = line.after.unreferenced_since is not None and line.before.unreferenced_since is None
    words = ", ".join(changes(line.before, line.after)) or _("no visible change")
    return ("warn" if gone else "changed"), f"{who}: {words}"


def changes(before: LineState, after: LineState) -> list[str]:
    """List the differences between two states of a line, in words."""
    differences: list[str] = []
    if (before.quantity, before.unit) != (after.quantity, after.unit):
        old, new = quantity(before.quantity, before.unit), quantity(after.quantity, after.unit)
        differences.append(_("quantity %(old)s → %(new)s", old=old, new=new))
    if before.unreferenced_since is None and after.unreferenced_since is not None:
        differences.append(_("no longer referenced by the assembly"))
    back = before.unreferenced_since is not None and after.unreferenced_since is None
    if back and after.source == "assembly":
        differences.append(_("referenced again"))
    if before.source != after.source:
        manual = after.source == "manual"
        differences.append(_("now a manual line") if manual else _("owned by the assembly again"))
    if before.reason != after.reason and after.reason:
        differences.append(_("reason: %(reason)s", reason=isolate(after.reason)))
    for name, words in _NAMES.items():
        old, new = (_quoted(getattr(state, name)) for state in (before, after))
        if old != new:
            differences.append(f"{_(words)} {old} → {new}")
    return differences


def sentences(
    lines: Sequence[ChangedLine], most: int = 30, count: int | None = None
) -> list[tuple[str, str]]:
    """Describe the lines of a change, which has ``count`` of them; beyond ``most`` only count them."""
    line_sentences = [sentence(line) for line in lines[:most]]
    rest = (len(lines) if count is None else count) - most
    return (
        [*line_sentences, ("", _("and %(lines)s", lines=plural(rest, "more line", "more lines")))]
        if rest > 0
        else line_sentences
    )


def _quoted(value: object) -> str:
    if isinstance(value, tuple):
        return isolate(" ".join(map(str, value))) or _("none")
    return _("none") if value is None or value == "" else f"“{isolate(str(value))}”"
