# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a sync leaves out of an assembly's BOM: an incomplete BOM must never look like a complete one.

The rules:

* only the assembly's direct children count; its sub-assemblies have a list of their own;
* paths are relative to the assembly's file, with ``/``, so that two machines agree on them;
* the list travels with the merge, and the server keeps that of the last one.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

from silo.bom.entry import BomEntry
from silo.bom.findings import Finding
from silo.bom.items.naming import display_name
from silo.bom.message import Message, beside, counted_message, joined
from silo.bom.view.folders import shorten
from silo.bom.walk.document import relative
from silo.bom.walk.standard import STANDARD_PARTS


class Reason(StrEnum):
    """Why something is not in a BOM."""

    MISSING = "missing"  # its file or object is not there, or cannot be read
    UNREGISTERED = "unregistered"  # it has no part number yet
    BROKEN = "broken"  # something else keeps the assembly from being read in full; see the message
    REFUSED = "refused"  # the server refused the merge; see the message
    HELD = "held"  # the whole BOM waits on a designer's computer; see the message


@dataclass(frozen=True, slots=True)
class LeftOut:
    """One thing that is left out.

    ``file`` (relative to the assembly's) and ``object`` name a component; ``message`` says more where a
    name does not. ``quantity`` is per one assembly, 0 where it is unknown.
    """

    reason: Reason
    name: str = ""
    file: str = ""
    object: str = ""
    quantity: int = 0
    message: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Return the fields that are set, as JSON values."""
        return {key: value for key, value in asdict(self).items() if value} | beside(self.message)


def components_of(entry: BomEntry, base: str) -> list[dict[str, str]]:
    """Return the components of a line, by which the server remembers it. ``base``: the assembly's folder.

    Standard parts have no file of their own that could be missing.
    """
    return [
        {"file": relative(path, base), "object": name}
        for path, name in (entry.key, *entry.also)
        if path not in ("", STANDARD_PARTS)
    ]


def left_out_of(
    entries: Iterable[BomEntry], unregistered: Iterable[BomEntry], errors: Iterable[Finding], base: str
) -> tuple[LeftOut, ...]:
    """List all that a BOM of these direct children leaves out.

    errors
        the findings that block this assembly. Those that missing entries explain are not repeated.
    """
    missing = [entry for entry in entries if entry.missing]
    explained = {name for entry in missing for name in entry.instances}
    outs = [_component(Reason.MISSING, entry, base) for entry in missing]
    outs += [_component(Reason.UNREGISTERED, entry, base) for entry in unregistered]
    outs += [
        LeftOut(Reason.BROKEN, message=shorten(finding.message, base))
        for finding in errors
        if not {place.obj for place in finding.where} <= explained
    ]
    return tuple(outs)


def _component(reason: Reason, entry: BomEntry, base: str) -> LeftOut:
    name = display_name(entry) or entry.object_name
    return LeftOut(reason, name, relative(entry.doc_path, base), entry.object_name, entry.quantity)


def remembered(
    before: Mapping[str, Sequence[Mapping[str, str]]],
    entries: Iterable[Mapping[str, Any]],
    kept: Iterable[str],
) -> dict[str, list[dict[str, str]]]:
    """Map each part number to the components that are kept for it after a merge.

    Lines that were kept because a component is missing keep their components, so that the next sync knows the
    component again.
    """
    fields_by_key: dict[str, list[dict[str, str]]] = {}
    for entry in entries:
        fields_by_key.setdefault(entry["child_part_number"], []).extend(
            map(dict, entry.get("components") or ())
        )
    for number in kept:
        mine = fields_by_key.setdefault(number, [])
        mine += [dict(fields) for fields in before.get(number, ()) if fields not in mine]
    return {number: components for number, components in fields_by_key.items() if components}


def in_words(left_out: Sequence[LeftOut] | Sequence[Mapping[str, Any]]) -> str:
    """Write ``2 missing, 1 unregistered``; "" if nothing is left out."""
    reasons = Counter(str(out["reason"] if isinstance(out, Mapping) else out.reason) for out in left_out)
    ordered = [*(reason for reason in Reason if reason in reasons), *reasons.keys() - set(Reason)]
    return joined(", ", [Message(f"{{n}} {reason}", {"n": reasons[reason]}) for reason in ordered])


def what_holds(left_out: Iterable[LeftOut] | Iterable[Mapping[str, Any]]) -> Message:
    """Say what holds a BOM back: ``2 files missing``. Parts without a number hold no BOM back."""
    reasons = Counter(str(out["reason"] if isinstance(out, Mapping) else out.reason) for out in left_out)
    missing = reasons.pop(Reason.MISSING, 0)
    reasons.pop(Reason.UNREGISTERED, 0)
    other = reasons.total()
    parts = [
        *([counted_message(missing, "{n} file missing", "{n} files missing")] if missing else ()),
        *([counted_message(other, "{n} other question", "{n} other questions")] if other and missing else ()),
        *(
            [counted_message(other, "{n} open question", "{n} open questions")]
            if other and not missing
            else ()
        ),
    ]
    return joined(", ", parts)
