# SPDX-License-Identifier: LGPL-2.1-or-later
"""The services' pure parts, and what both databases must do alike underneath."""

from __future__ import annotations

import uuid
from collections import namedtuple
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from datetime import timedelta
from decimal import Decimal
from types import SimpleNamespace
from typing import Any

import pytest
from hunting import over
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import select, update

from silo.bom.errors import AuthError, ConflictError, RejectedError
from silo.bom.headers import plain_cell, safe_cell
from silo.bom.quantities import quantity_of
from silo_server.actors import SYSTEM, Actor, Role
from silo_server.db.database import Database
from silo_server.db.rows import insert_rows, one_of, update_rows
from silo_server.db.tables import answers, items, users
from silo_server.fields import from_row, to_wire
from silo_server.services.access.login_links import create_login_link, use_login_link
from silo_server.services.access.sessions import actor_by_session
from silo_server.services.access.tokens import (
    Token,
    actor_by_token,
    create_own_token,
    create_token,
    revoke_token,
    secret_of_form,
)
from silo_server.services.access.users import create_user
from silo_server.services.bom.line_edit import check_state, edited_state
from silo_server.services.bom.line_state import state_to_json, stored_state
from silo_server.services.bom.merge_request import read_merge_request
from silo_server.services.field_checks import quantity_problem
from silo_server.services.items import NewItem, create_item
from silo_server.services.product.export import _numbered
from silo_server.services.product.parts import positive_number
from silo_server.times import stamp, utc_now, wire_time
from silo_server.user_json import dumps
from silo_server.values import LineState

text = st.text(max_size=20)
# As fields and bodies are read: a quantity is the decimal number that was typed.
quantities = st.floats(1e-6, 1e9).map(quantity_of)
states = st.builds(
    LineState,
    quantity=quantities,
    source=st.sampled_from(["assembly", "manual"]),
    rel_type=st.sampled_from(["component", "alternate", "reference"]),
    unit=st.none() | text,
    reference_designators=st.lists(text, max_size=3).map(tuple),
    find_number=st.none() | text,
    notes=st.none() | text,
    child_revision=st.none() | st.integers(0, 9),
    unreferenced_since=st.none() | st.just("2026-02-08T22:15:00.000000Z"),
    override=st.booleans(),
    cad_quantity=st.none() | quantities,
    reason=st.none() | text,
    metadata=st.dictionaries(text, st.integers() | text, max_size=2),
)


@given(states)
def test_a_state_comes_back_from_the_history_as_it_was(state: LineState) -> None:
    """Every field survives being stored; a field that is added must too."""
    assert stored_state(dumps(state_to_json(state))) == state
    assert {f.name for f in fields(LineState)} >= set(state_to_json(state))


@given(states, quantities)
def test_a_person_s_quantity_always_ends_up_a_person_s_or_the_assembly_s_own(
    state: LineState, quantity: Decimal
) -> None:
    """After another quantity by hand a line is manual, unless it is what the assembly said."""
    after = edited_state(state, {"quantity": quantity})
    if quantity == state.quantity:
        assert after == state
    elif after.source == "assembly":
        assert state.override
        assert not after.override
        assert after.cad_quantity is None
    elif state.source == "assembly":
        assert after.override
        assert after.cad_quantity == state.quantity
        assert after.unreferenced_since is None
    kept = replace(after, quantity=0, source="", override=False, cad_quantity=None, unreferenced_since=None)
    was = replace(state, quantity=0, source="", override=False, cad_quantity=None, unreferenced_since=None)
    assert kept == was


@given(states)
def test_a_source_that_is_given_wins(state: LineState) -> None:
    """What a client says of the owner holds, whatever the quantity does."""
    ours = edited_state(state, {"quantity": state.quantity + 1, "source": "assembly"})
    assert (ours.source, ours.override, ours.cad_quantity) == ("assembly", False, None)
    theirs = edited_state(state, {"source": "manual"})
    assert (theirs.source, theirs.unreferenced_since) == ("manual", None)


def test_all_that_is_wrong_with_a_line_is_reported_at_once() -> None:
    """Quantity, relation, source and lengths together."""
    bad = LineState(-1.0, "dream", "friend", unit="x" * 40)
    with pytest.raises(RejectedError) as caught:
        check_state(bad)
    assert [problem.split(":")[0] for problem in caught.value.problems] == [
        "quantity",
        "rel_type",
        "source",
        "unit",
    ]


@pytest.mark.parametrize(
    ("value", "fine"),
    [
        (1, True),
        (0.5, True),
        (1000000000.0, True),
        (1000000000.0 + 1, False),
        (0, False),
        (-1, False),
        (10**400, False),
        (True, False),
        ("1", False),
        (None, False),
        (float("nan"), False),
        (float("inf"), False),
    ],
)
def test_quantities(value: Any, fine: bool) -> None:
    """A finite number above zero, of a size that a tree can be multiplied with."""
    assert (quantity_problem(value) is None) == fine


@given(
    st.recursive(
        st.none() | st.booleans() | st.floats() | text, lambda x: st.lists(x) | st.dictionaries(text, x)
    )
)
def test_no_body_breaks_the_reader(body: Any) -> None:
    """Whatever JSON comes, it is read or refused in words."""
    for candidate in (body, {"entries": body}, {"entries": [body], "document": body, "sync_id": body}):
        with suppress(RejectedError):
            request = read_merge_request(candidate, 100)
            assert len(request.entries) + len(request.problems) >= len(candidate["entries"])


@given(st.text(max_size=30))
def test_a_safe_cell_is_no_formula_and_comes_back(cell: str) -> None:
    """CSV injection: never begins like a formula; the import reads what the export was given."""
    safe = safe_cell(cell)
    assert not safe.startswith(("=", "+", "-", "@", "\t", "\r", "\n"))
    assert plain_cell(safe) == cell


def test_numbers_stay_numbers_in_cells() -> None:
    """A quantity is no text, whatever its sign."""
    assert safe_cell(-1.5) == -1.5


def test_item_numbers_follow_the_depth() -> None:
    """1, 1.1, 1.2, 1.2.1, 2, 2.1."""
    rows: Any = [SimpleNamespace(depth=depth) for depth in (1, 2, 2, 3, 1, 2)]
    assert [number for _, number in _numbered(rows)] == ["1", "1.1", "1.2", "1.2.1", "2", "2.1"]


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (1, 1.0),
        ("0.25", 0.25),
        (0, 0.0),
        (-1, None),
        ("1 kg", None),
        (True, None),
        (None, None),
        (10**400, None),
        ("nan", None),
        ("inf", None),
        ([], None),
    ],
)
def test_a_property_is_a_number_or_missing(value: Any, expected: float | None) -> None:
    """Never guessed: what is no plain number is missing."""
    assert positive_number({"mass_kg": value}, "mass_kg") == expected


def test_roles_include_the_lower_ones() -> None:
    """viewer < editor < admin."""
    assert [[a.covers(b) for b in Role] for a in Role] == [
        [True, False, False],
        [True, True, False],
        [True, True, True],
    ]


def test_times_sort_as_they_read() -> None:
    """Stored with microseconds, reported in the spec's seconds."""
    first, second = stamp(utc_now()), stamp(utc_now())
    assert first <= second
    assert len(first) == len("2026-02-08T22:15:00.000000Z")
    assert wire_time("2026-02-08T22:15:00.123456Z") == "2026-02-08T22:15:00.123456Z"
    assert wire_time(None) is None


def test_many_rows_go_in_and_change_in_one_statement_each(db: Database) -> None:
    """Both databases take thousands of rows, nulls and any text, and find them by a set."""
    with db.write() as tx:
        rows = [
            {
                "subject": "merge 1",
                "key": f"s{n}",
                "request_hash": "h",
                "answer": "Ünïcode '\" \\ {} , NULL \n" + str(n),
                "version": n,
                "at": "t",
            }
            for n in range(5000)
        ]
        insert_rows(tx, answers, rows)
        insert_rows(tx, answers, [])
        wanted = [f"s{n}" for n in range(0, 5000, 2)] + ["none", "'; DROP TABLE items; --"]
        query = select(answers.c.key, answers.c.answer)
        found = tx.conn.execute(query.where(one_of(tx, answers.c.key, wanted))).all()
        assert len(found) == 2500
        assert dict(found)["s42"] == rows[42]["answer"]
        assert tx.conn.execute(query.where(one_of(tx, answers.c.key, []))).all() == []


def test_a_bulk_update_changes_only_its_rows(db: Database) -> None:
    """By key, several columns, with nulls."""
    with db.write() as tx:
        for n in range(20):
            create_item(tx, NewItem(part_number=f"X-{n}", name="x"))
        ids = tx.conn.scalars(select(items.c.id).order_by(items.c.id)).all()
        update_rows(
            tx,
            items,
            "id",
            [{"id": i, "name": f"n{i}", "sourcing_type": None if i % 2 else "purchased"} for i in ids[:10]],
        )
        update_rows(tx, items, "id", [])
        names = {row.id: (row.name, row.sourcing_type) for row in tx.conn.execute(select(items))}
    assert names[ids[0]] == (f"n{ids[0]}", None if ids[0] % 2 else "purchased")
    assert names[ids[15]] == ("x", None)


@over("sqlite")
def test_the_secret_of_a_form_is_given_again_for_a_minute(db: Database) -> None:
    """A repeat of the form is the same token; later, or after it was revoked, the secret stays unknown."""
    with db.write() as tx:
        user_id = tx.conn.scalar(select(users.c.id))
    actor = Actor("admin", Role.ADMIN, user_id, auth_source="session", csrf_token="of the session")
    other = replace(actor, csrf_token="of another session")
    wanted = secret_of_form(actor, "key", "laptop")
    assert wanted not in (secret_of_form(other, "key", "laptop"), secret_of_form(actor, "key", "phone"))
    assert secret_of_form(replace(actor, csrf_token=None), "key") is None

    def make(secret: str | None) -> tuple[Token, str]:
        with db.write(actor) as tx:
            return create_own_token(tx, "laptop", days=30, forever=False, secret=secret)

    first, secret = make(wanted)
    assert secret == wanted
    assert make(wanted) == (first, secret)
    now = db.clock
    db.clock = lambda: now() + timedelta(minutes=2)
    with pytest.raises(ConflictError, match="shown once"):
        make(wanted)
    fresh, secret = make(secret_of_form(actor, "key 2"))
    with db.write(actor) as tx:
        revoke_token(tx, fresh.id, user_id)
    with pytest.raises(ConflictError, match="shown once"):
        make(secret)


@over("sqlite")
def test_sessions_and_links_end(db: Database) -> None:
    """By the clock, and with their user: also where the rows are still there."""

    def link(name: str) -> str:
        with db.write(SYSTEM) as tx:
            return create_login_link(tx, name)

    def lock_out(active: bool) -> None:
        with db.write() as tx:
            tx.conn.execute(update(users).where(users.c.username == "ann").values(active=active))

    with db.write(SYSTEM) as tx:
        ann = create_user(tx, "ann", Role.EDITOR)
        _, token = create_token(tx, ann.id, "laptop")
    session = use_login_link(db, link("ann"), "here")
    early, late = link("ann"), link("ann")
    actor = actor_by_session(db, session.secret, "here")
    assert actor is not None
    assert (actor.username, actor.by_link) == ("ann", True)
    assert actor_by_token(db, token, "here") is not None
    lock_out(False)
    assert actor_by_session(db, session.secret, "here") is None
    assert actor_by_token(db, token, "here") is None
    with pytest.raises(AuthError):
        use_login_link(db, early, "here")
    lock_out(True)
    assert actor_by_session(db, session.secret, "here") is not None
    now = db.clock
    db.clock = lambda: now() + timedelta(seconds=db.settings.login_link_seconds + 1)
    with pytest.raises(AuthError):
        use_login_link(db, late, "here")
    assert actor_by_session(db, session.secret, "here") is not None
    db.clock = lambda: now() + timedelta(seconds=db.settings.session_seconds + 1)
    assert actor_by_session(db, session.secret, "here") is None


@over("sqlite")
def test_a_failed_transaction_leaves_nothing(db: Database) -> None:
    """All or nothing, the item's event and number included."""
    name = uuid.uuid4().hex

    def fail() -> None:
        with db.write() as tx:
            create_item(tx, NewItem(category="F01", name=name))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    with db.write() as tx:
        assert create_item(tx, NewItem(category="F01", name=name))[0].part_number == "F01-0001"


def test_a_value_is_read_and_written_by_its_own_names() -> None:
    """Times lose an empty fraction; what a row has not is given; nothing else is changed or shown."""

    @dataclass(frozen=True, slots=True)
    class Value:
        id: int
        flat: bool
        created_at: str
        since: str | None
        note: str = ""

    kind = namedtuple("kind", "id flat created_at since other")
    row = kind(7, True, "2026-02-08T22:15:00.000000Z", None, "x")
    value = from_row(Value, row, note="given")
    assert value == Value(7, True, "2026-02-08T22:15:00.000000Z", None, "given")
    told = {"flat": True, "created_at": "2026-02-08T22:15:00Z", "since": None, "note": "given"}
    assert to_wire(value, "id") == told
