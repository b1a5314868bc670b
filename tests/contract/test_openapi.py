# SPDX-License-Identifier: LGPL-2.1-or-later
"""schemathesis against the OpenAPI document: no 5xx, no undocumented status, type or body."""

from __future__ import annotations

import tempfile
import warnings
from contextlib import suppress
from typing import Any

import pytest
from hunting import examples, over
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st
from server_testing import Api

from silo_server.run import RunningServer, create_app
from silo_server.settings import Settings

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import schemathesis
    from schemathesis import GenerationMode
    from schemathesis.checks import not_a_server_error
    from schemathesis.specs.openapi.checks import (
        content_type_conformance,
        response_schema_conformance,
        status_code_conformance,
    )

CHECKS = (
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_schema_conformance,
)
# The stream never ends; its own tests look after it.
SKIPPED = {("GET", "/api/events")}
EXAMPLES = examples(6)

# A server makes its database's file, also where only its document is wanted.
with tempfile.TemporaryDirectory() as _folder:
    SCHEMA = schemathesis.openapi.from_dict(
        create_app(Settings(database_url=f"sqlite:///{_folder}/silo.db")).openapi()
    )
OPERATIONS = {
    f"{operation.method.upper()} {operation.path}": operation
    for operation in (result.ok() for result in SCHEMA.get_all_operations())
    if (operation.method.upper(), operation.path) not in SKIPPED
}


WITH_QUERY = {name for name, operation in OPERATIONS.items() if operation.query}


@pytest.fixture(scope="module")
def known(server: RunningServer) -> list[str]:
    """Items with a BOM, a history and a file, so that the random requests meet something."""
    with Api(server.base_url, server.token) as api:
        top, sub, leaf = api.items(3)
        api.merge(top, {sub: 2, leaf: 1})
        api.merge(sub, {leaf: 4})
        api.merge(top, {sub: 2})
    return [top, sub, leaf]


@over("sqlite")
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", OPERATIONS)
def test_no_answer_is_a_fault_or_undocumented(name: str, server: RunningServer, known: list[str]) -> None:
    """Random requests by the document, some about items that exist: every answer is one the document has."""
    headers = {"Authorization": f"Bearer {server.token}"}

    @settings(max_examples=EXAMPLES, suppress_health_check=list(HealthCheck))
    @given(case=OPERATIONS[name].as_strategy(), data=st.data())
    def run(case: Any, data: st.DataObject) -> None:
        meet_what_exists(case, data, known)
        response = case.call(base_url=server.base_url, headers=headers, timeout=60)
        case.validate_response(response, checks=CHECKS)

    try:
        run()
    finally:
        if name == "PUT /api/admin/mode":
            with Api(server.base_url, server.token) as api:
                api.good("PUT", "/api/admin/mode", {"mode": "normal"})


@over("postgres")  # it refuses more
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", OPERATIONS)
def test_no_invalid_request_is_a_fault(name: str, server: RunningServer, known: list[str]) -> None:
    """Requests that break the document, from a seed: none is a 5xx (more: ``server_fuzz.py``)."""
    headers = {"Authorization": f"Bearer {server.token}"}
    mode = GenerationMode.NEGATIVE if OPERATIONS[name].body or name in WITH_QUERY else GenerationMode.POSITIVE

    @seed(17)
    @settings(max_examples=2, suppress_health_check=list(HealthCheck))
    @given(case=OPERATIONS[name].as_strategy(generation_mode=mode), data=st.data())
    def run(case: Any, data: st.DataObject) -> None:
        meet_what_exists(case, data, known)
        response = case.call(base_url=server.base_url, headers=headers, timeout=60)
        case.validate_response(response, checks=(not_a_server_error,))

    try:
        run()
    finally:
        if name == "PUT /api/admin/mode":
            with Api(server.base_url, server.token) as api:
                api.good("PUT", "/api/admin/mode", {"mode": "normal"})


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
