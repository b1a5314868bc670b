# SPDX-License-Identifier: LGPL-2.1-or-later
"""A merge's request, answer and event, in exactly the spec's JSON (bom-sync §5).

The request is read by hand and not by a model, because a bad quantity and an unknown part number are reported
together, each with the index of its entry, in the one 400.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any, TypeGuard

from silo.bom.errors import RejectedError
from silo.bom.left_out import Reason
from silo.bom.merge import summary
from silo.bom.model import BomDiff
from silo.bom.numbers import LARGEST_QUANTITY, as_decimal
from silo_server.clock import spec_time
from silo_server.db.engine import Tx
from silo_server.errors import TooLargeError
from silo_server.json_values import is_text
from silo_server.values import Item

# An event goes to every listener: beyond this many unchanged lines it only says how many there are.
EVENT_UNCHANGED_LINES = 500


@dataclass(frozen=True, slots=True)
class OrderEntry:
    """One direct child as asked for; ``key`` is its case-folded number."""

    index: int
    part_number: str
    quantity: float
    components: Sequence[Mapping[str, str]] = ()

    @property
    def key(self) -> str:
        return self.part_number.casefold()


@dataclass(frozen=True, slots=True)
class MergeOrder:
    """A merge request. ``problems`` are (index, text) of the entries that are unusable in themselves."""

    entries: Sequence[OrderEntry]
    problems: Sequence[tuple[int, str]] = ()
    sync_id: str | None = None
    dry_run: bool = False
    document_file: str | None = None
    document_folder: str | None = None
    document_sha256: str | None = None
    document_revision: int | None = None
    left_out: Sequence[Mapping[str, Any]] = ()

    @property
    def missing(self) -> list[tuple[str, str]]:
        """The components that the assembly has lost."""
        return [
            (one.get("file", ""), one.get("object", ""))
            for one in self.left_out
            if one["reason"] == Reason.MISSING
        ]


def read_merge_order(body: Any, max_entries: int) -> MergeOrder:
    """The order in a decoded JSON body; RejectedError where the body as a whole is unusable.

    Unknown keys are ignored. Whatever ``source`` says, the entries are an assembly's.
    """
    if not isinstance(body, Mapping) or not isinstance(body.get("entries"), list):
        raise RejectedError('body: wanted {"entries": [{"child_part_number": …, "quantity": …}, …]}')
    if len(body["entries"]) > max_entries:
        raise TooLargeError(f"entries: this server takes at most {max_entries}, got {len(body['entries'])}")
    sync_id, dry_run = body.get("sync_id"), body.get("dry_run")
    if sync_id is not None and not (is_short_text(sync_id, 128) and sync_id):
        raise RejectedError("sync_id: wanted a text of 1 to 128 characters")
    if dry_run is not None and not isinstance(dry_run, bool):
        raise RejectedError("dry_run: wanted true or false")
    document = _document(body.get("document"))
    entries: list[OrderEntry] = []
    problems: list[tuple[int, str]] = []
    for index, raw in enumerate(body["entries"]):
        entry, problem = _entry(index, raw)
        if entry is not None:
            entries.append(entry)
        if problem is not None:
            problems.append((index, problem))
    if not problems:
        problems = _sums_too_large(entries)
    left_out = _left_out(body.get("left_out"), max_entries)
    return MergeOrder(entries, problems, sync_id, bool(dry_run), *document, left_out)


def is_short_text(value: Any, longest: int) -> TypeGuard[str]:
    """True for a text of at most so many characters that both databases can keep."""
    return isinstance(value, str) and len(value) <= longest and is_text(value)


def sha256_or_none(name: str, value: Any) -> str | None:
    """A SHA-256 in small hex digits, or None; RejectedError, naming the field, for anything else."""
    if value is None:
        return None
    if isinstance(value, str) and re.fullmatch("[0-9A-Fa-f]{64}", value):
        return value.lower()
    raise RejectedError(f"{name}: wanted 64 hexadecimal digits")


def quantity_problem(value: Any) -> str | None:
    """What is wrong with a quantity, None where nothing is."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return f"wanted a number, got {_shown(value)}"
    # A huge integer has no float; comparing it does no harm where converting it would.
    if not 0 < value <= LARGEST_QUANTITY or not math.isfinite(value):
        return f"wanted a number above 0 and at most 1e9, got {_shown(value)}"
    return None


def _sums_too_large(entries: Sequence[OrderEntry]) -> list[tuple[int, str]]:
    """A child that is named several times counts as the sum, which has the limit that one entry has."""
    sums: dict[str, Decimal] = {}
    problems = []
    for entry in entries:
        sums[entry.key] = sums.get(entry.key, Decimal(0)) + as_decimal(entry.quantity)
        if sums[entry.key] > LARGEST_QUANTITY:
            text = f"entries[{entry.index}].quantity: all entries of {entry.part_number!r} add up to over 1e9"
            problems.append((entry.index, text))
    return problems


def _entry(index: int, raw: Any) -> tuple[OrderEntry | None, str | None]:
    if not isinstance(raw, Mapping):
        return None, f"entries[{index}]: wanted an object, got {_shown(raw)}"
    name, quantity = raw.get("child_part_number"), raw.get("quantity")
    problem = quantity_problem(quantity)
    text = None if problem is None else f"entries[{index}].quantity: {problem}"
    if not is_short_text(name, 200) or not name.strip():
        missing = f"entries[{index}].child_part_number: wanted a part number, got {_shown(name)}"
        return None, missing if text is None else f"{missing}; {text}"
    # An entry with a bad quantity is still looked up, so that an unknown number is reported as well.
    components, wrong = _components(index, raw.get("components"))
    entry = OrderEntry(index, name.strip(), 1.0 if text else float(quantity or 0), components)
    return entry, "; ".join(filter(None, (text, wrong))) or None


def _components(index: int, raw: Any) -> tuple[Sequence[Mapping[str, str]], str | None]:
    if raw is None:
        return (), None
    if not isinstance(raw, list) or not all(
        isinstance(one, Mapping)
        and is_short_text(one.get("file"), 4096)
        and is_short_text(one.get("object", ""), 1024)
        for one in raw
    ):
        return (), f'entries[{index}].components: wanted [{{"file": …, "object": …}}, …], got {_shown(raw)}'
    return [{"file": one["file"], "object": one.get("object", "")} for one in raw], None


_LEFT_OUT_TEXTS = {"reason": 32, "name": 1024, "file": 4096, "object": 1024, "message": 4096}


def _left_out(raw: Any, most: int) -> list[dict[str, Any]]:
    if raw is None:
        return []
    if not isinstance(raw, list) or len(raw) > most:
        raise RejectedError(f"left_out: wanted a list of at most {most} objects, got {_shown(raw)}")
    return [_left_out_part(index, one) for index, one in enumerate(raw)]


def _left_out_part(index: int, raw: Any) -> dict[str, Any]:
    if not isinstance(raw, Mapping) or not raw.get("reason"):
        raise RejectedError(f'left_out[{index}]: wanted {{"reason": …, "name": …, …}}, got {_shown(raw)}')
    part: dict[str, Any] = {}
    for name, longest in _LEFT_OUT_TEXTS.items():
        value = raw.get(name, "")
        if not is_short_text(value, longest):
            raise RejectedError(
                f"left_out[{index}].{name}: wanted at most {longest} characters, got {_shown(value)}"
            )
        if value:
            part[name] = value
    quantity = raw.get("quantity", 0)
    if isinstance(quantity, bool) or quantity != 0:
        if problem := quantity_problem(quantity):
            raise RejectedError(f"left_out[{index}].quantity: {problem}")
        part["quantity"] = quantity
    return part


def _document(raw: Any) -> tuple[str | None, str | None, str | None, int | None]:
    if raw is None:
        return None, None, None, None
    if not isinstance(raw, Mapping):
        raise RejectedError('document: wanted {"file": …, "sha256": …, "revision": …}')
    file, folder, revision = raw.get("file"), raw.get("folder"), raw.get("revision")
    if not is_short_text(file, 4096):
        raise RejectedError("document.file: wanted a file name of at most 4096 characters")
    if folder is not None and not is_short_text(folder, 1024):
        raise RejectedError("document.folder: wanted a folder of at most 1024 characters")
    sha256 = sha256_or_none("document.sha256", raw.get("sha256"))
    if isinstance(revision, float) and revision.is_integer():
        revision = int(revision)  # 2.0 is a whole number in JSON
    if revision is not None and not (type(revision) is int and 0 <= revision < 2**31):
        raise RejectedError("document.revision: wanted a whole number")
    return file, folder, sha256, revision


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "…"


def event_of(tx: Tx, parent: Item, diff: BomDiff, answer: Mapping[str, Any]) -> dict[str, Any]:
    """The spec's event; ``warnings`` only where there is a conflict, which the diff does not say."""
    told = dict(answer["diff"])
    if len(told["unchanged"]) > EVENT_UNCHANGED_LINES:
        told["unchanged_count"] = len(told["unchanged"])
        told["unchanged"] = []
    event: dict[str, Any] = {
        "type": "bom_merge",
        "item": parent.part_number,
        "user": tx.actor.username,
        "timestamp": spec_time(tx.stamp),
        "summary": summary(diff),
        "diff": told,
        "resolve_url": answer["resolve_url"],
    }
    if "sync_id" in answer:
        event["sync_id"] = answer["sync_id"]
    if "left_out" in answer:
        event["left_out"] = answer["left_out"][:EVENT_UNCHANGED_LINES]
    if diff.conflicts:
        event["warnings"] = answer["warnings"]
    return event
