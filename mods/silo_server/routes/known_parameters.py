# SPDX-License-Identifier: LGPL-2.1-or-later
"""An address with a parameter that its route does not declare is refused.

``?rel=B`` for ``?release=B`` would show the draft, and nothing on paper would say so. This holds for the
pages and for the files that are made of a BOM; other routes of the API take what newer clients send.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from fastapi import Request
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute

from silo.bom.errors import RejectedError, did_you_mean
from silo.bom.message import joined, message
from silo_server.routes.call import SAFE_METHODS


def refuse_unknown(*besides: str) -> Callable[[Request], None]:
    """Make the dependency that raises RejectedError for unknown parameters; ``besides``: also known."""

    def refuse(request: Request) -> None:
        route = request.scope.get("route")
        if request.method not in SAFE_METHODS or not isinstance(route, APIRoute):
            return
        declared = set(_declared(route.dependant))
        problems = [
            message(
                "this address has no parameter {name}{near}",
                name=repr(name[:80]),
                near=did_you_mean(name, declared),
            )
            for name in dict.fromkeys(request.query_params.keys())
            if name not in declared and name not in besides
        ]
        if problems:
            raise RejectedError(joined("; ", problems), problems)

    return refuse


def _declared(dependant: Dependant) -> Iterator[str]:
    yield from (field.alias for field in dependant.query_params)
    for inner in dependant.dependencies:
        yield from _declared(inner)
