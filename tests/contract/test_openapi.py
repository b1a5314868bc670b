# SPDX-License-Identifier: LGPL-2.1-or-later
"""schemathesis against the OpenAPI document: no 5xx, no undocumented status, type or body."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import pytest
from hunting import examples, over
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from server_testing import Api

from silo_server.run import RunningServer

# The stream never ends; its own tests look after it.
SKIPPED = "/api/events"
MODE = "/api/admin/mode"
EXAMPLES = examples(3)
PARTS = 4


@pytest.fixture(scope="module")
def operations(server: RunningServer) -> list[Any]:
    """All operations of the document, but the stream."""
    import schemathesis  # takes seconds, which no process that runs other tests should spend

    schema = schemathesis.openapi.from_dict(server.app.openapi())
    made = (result.ok() for result in schema.get_all_operations())
    return [operation for operation in made if operation.path != SKIPPED]


@pytest.fixture(scope="module")
def known(server: RunningServer) -> list[str]:
    """Items with a BOM, a history and a file, so that the random requests meet something."""
    with Api(server.base_url, server.token) as api:
        top, sub, leaf = api.items(3)
        api.merge(top, {sub: 2, leaf: 1})
        api.merge(sub, {leaf: 4})
        api.merge(top, {sub: 2})
    return [top, sub, leaf]


@over("postgres")  # it refuses more
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("part", range(PARTS))
def test_no_answer_is_a_fault_or_undocumented(
    part: int, server: RunningServer, operations: list[Any], known: list[str]
) -> None:
    """Random requests, some about items that exist: each answer to a valid one is in the document.

    No answer is a fault, not even to requests that break the document (more: ``server_fuzz.py``).
    """
    from schemathesis import GenerationMode
    from schemathesis.checks import not_a_server_error
    from schemathesis.specs.openapi import checks

    documented = (
        not_a_server_error,
        checks.status_code_conformance,
        checks.content_type_conformance,
        checks.response_schema_conformance,
    )
    headers = {"Authorization": f"Bearer {server.token}"}

    def send(operation: Any, mode: GenerationMode, count: int, wanted: Sequence[Any]) -> None:
        @settings(max_examples=count, suppress_health_check=list(HealthCheck))
        @given(case=operation.as_strategy(generation_mode=mode), data=st.data())
        def run(case: Any, data: st.DataObject) -> None:
            meet_what_exists(case, data, known)
            response = case.call(base_url=server.base_url, headers=headers, timeout=60)
            case.validate_response(response, checks=wanted)

        run()

    for operation in operations[part::PARTS]:
        try:
            send(operation, GenerationMode.POSITIVE, EXAMPLES, documented)
            if operation.body or operation.query:
                send(operation, GenerationMode.NEGATIVE, 2, (not_a_server_error,))
        finally:
            if operation.path == MODE:
                with Api(server.base_url, server.token) as api:
                    api.good("PUT", MODE, {"mode": "normal"})


def meet_what_exists(case: Any, data: st.DataObject, known: list[str]) -> None:
    """Put items that exist into some of the paths and bodies, and spare the caller's own token."""
    parameters = case.path_parameters or {}
    for key in parameters.keys() & {"part_number", "child"}:
        if data.draw(st.integers(0, 3)):
            parameters[key] = data.draw(st.sampled_from(known))
    if "token_id" in parameters:
        with suppress(ValueError):
            parameters["token_id"] = 1_000_000 + int(parameters["token_id"]) % 1_000_000
    if isinstance(case.body, dict) and "child_part_number" in case.body and data.draw(st.booleans()):
        case.body["child_part_number"] = data.draw(st.sampled_from(known))
