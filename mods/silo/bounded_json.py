# SPDX-License-Identifier: LGPL-2.1-or-later
"""JSON from outside, read within a budget.

* The text is counted before it is parsed: a parsed ``{}`` takes thirty times its two bytes.
* A container is an object of the budget. Each key, scalar and container is a value of it.
* The nesting is bounded by the parser's own limit, which is reported like the others.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import Any

from silo.bom.message import message
from silo.budget import Account, Budget, Limit, OverBudgetError

# An open text ends with the bytes. So no text is read twice.
_TEXT = re.compile(rb'"[^"\\]*+(?:\\.[^"\\]*+)*+"?', re.DOTALL)
_EMPTY = re.compile(rb"[\[{][ \t\r\n]*+[\]}]")


def read_json(
    data: bytes, budget: Budget, source: str, parse_constant: Callable[[str], Any] | None = None
) -> Any:
    """Parse JSON. Raises OverBudgetError, and ValueError as :func:`json.loads` does."""
    account = budget.account(source)
    account.take_bytes(len(data))
    encoding = json.detect_encoding(data)
    if not encoding.startswith("utf-8"):
        data = data.decode(encoding, "surrogatepass").encode("utf-8", "surrogatepass")
    count_json(data, account)
    try:
        return json.loads(data, parse_constant=parse_constant)
    except RecursionError:
        raise OverBudgetError(
            message("{source}: it is nested too deep", source=source), Limit.DEPTH
        ) from None


def count_json(data: bytes, account: Account) -> None:
    """Count the containers and values of UTF-8 JSON that is not parsed yet; broken JSON is counted too."""
    containers, values = _counts(data)
    if containers > account.budget.objects or values > account.budget.cells:
        # Brackets and commas inside texts are none.
        containers, values = _counts(_TEXT.sub(b"", data))
    account.take_objects(containers)
    account.take_cells(values)


def _counts(data: bytes) -> tuple[int, int]:
    containers = data.count(b"{") + data.count(b"[")
    # A value stands behind each comma and colon, first in each container that is not empty, and outermost.
    empty = sum(1 for _ in _EMPTY.finditer(data))
    return containers, containers - empty + data.count(b",") + data.count(b":") + 1
