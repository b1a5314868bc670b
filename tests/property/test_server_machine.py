# SPDX-License-Identifier: LGPL-2.1-or-later
"""Random merges, edits, decisions, undos and restores by several users, against a simple model.

The model is a dict of lines and the snapshots of every change; it knows nothing of SQL, plans or history.
"""

from __future__ import annotations

import copy
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import pytest
from hunting import examples, kinds
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)
from server_testing import Databases, merge_body

from silo.bom.errors import ConflictError, NotFoundError, RejectedError, VersionConflictError
from silo_server.actors import Actor, Role
from silo_server.db.database import Database
from silo_server.errors import DuplicateError
from silo_server.run import prepare
from silo_server.services.bom import history
from silo_server.services.bom.conflicts import open_conflicts
from silo_server.services.bom.decisions import Decision, ReviewAction, resolve
from silo_server.services.bom.line_edit import add_line, change_line, remove_line
from silo_server.services.bom.lines import lines_of
from silo_server.services.bom.merge import merge_bom, preview_merge
from silo_server.services.bom.merge_request import read_merge_request
from silo_server.services.bom.restore import restore_bom, undo_change
from silo_server.services.items import NewItem, create_item, get_item
from silo_server.settings import Settings
from silo_server.values import LineState

PARTS = ["P-1", "P-2", "P-3", "P-4", "P-5"]
part = st.sampled_from(PARTS)
quantity = st.sampled_from([1.0, 2.0, 3.0, 0.5])
cad = st.dictionaries(part, quantity, max_size=len(PARTS))
user = st.sampled_from(["ann", "bob", "eve"])

Model = dict[str, dict[str, Any]]


class Silo(RuleBasedStateMachine):
    """One BOM, several users."""

    db: ClassVar[Database]

    @initialize()
    def begin(self) -> None:
        """A new, empty BOM."""
        with self.db.write() as tx:
            self.parent = create_item(tx, NewItem(category="A01", name="Top"))[0].part_number
        self.model: Model = {}
        self.accepted: dict[str, float] = {}  # part → the CAD quantity that a person answered "keep Silo's"
        self.conflicts: dict[str, float] = {}  # part → what CAD said in the last merge, where it differs
        self.version = 0
        self.snapshots: dict[int, Model] = {0: {}}
        self.syncs: dict[str, tuple[dict[str, float], str]] = {}

    def do(self, who: str, action: Callable[[Any], Any]) -> Any:
        """One transaction of a user."""
        with self.db.write(Actor(who, Role.EDITOR)) as tx:
            return action(tx)

    def changed(self, before: Model) -> None:
        """The model changed: count the version where a line changed, keep the snapshot."""
        self.version += before != self.model
        with self.db.read() as tx:
            newest = history.list_changes(tx, get_item(tx, self.parent), 1)
        self.snapshots[newest[0].id] = copy.deepcopy(self.model)

    @rule(entries=cad, who=user)
    def merge(self, entries: dict[str, float], who: str) -> None:
        """A sync from CAD; its preview says the same first."""
        sync_id = f"{self.parent}-{len(self.syncs)}"
        request = read_merge_request(merge_body(entries, sync_id=sync_id), 100)
        with self.db.read() as tx:
            preview = preview_merge(tx, self.parent, request, None)
        before = copy.deepcopy(self.model)
        outcome = self.do(who, lambda tx: merge_bom(tx, self.parent, request, None))
        self._merge_in_the_model(entries)
        assert outcome.answer == preview.answer
        self.syncs[sync_id] = (entries, outcome.answer)
        self.changed(before)
        assert outcome.version == self.version

    def _merge_in_the_model(self, entries: dict[str, float]) -> None:
        conflicts = {}
        for number, line in self.model.items():
            wanted = entries.get(number)
            if line["source"] == "manual":
                if wanted is None and line["override"]:
                    conflicts[number] = 0.0
                elif wanted is not None and wanted != line["quantity"]:
                    conflicts[number] = wanted
            else:
                line["quantity"] = wanted if wanted is not None else line["quantity"]
                line["unreferenced"] = wanted is None
        for number in entries.keys() - self.model.keys():
            self.model[number] = new_line(entries[number], "assembly")
        self.accepted = {n: q for n, q in self.accepted.items() if conflicts.get(n) == q}
        self.conflicts = conflicts

    @precondition(lambda self: self.syncs)
    @rule(data=st.data())
    def repeat_a_sync(self, data: st.DataObject) -> None:
        """The same request again, however late and by whatever version: the same answer, nothing changes."""
        sync_id = data.draw(st.sampled_from(sorted(self.syncs)))
        entries, answer = self.syncs[sync_id]
        request = read_merge_request(merge_body(entries, sync_id=sync_id), 100)
        outcome = self.do("ann", lambda tx: merge_bom(tx, self.parent, request, -1))
        assert outcome.answer == answer

    @rule(number=part, amount=quantity, who=user)
    def add(self, number: str, amount: float, who: str) -> None:
        """A line by hand; refused where there is one."""
        new = LineState(amount, "manual")
        before = copy.deepcopy(self.model)
        if number in self.model:
            with pytest.raises(DuplicateError):
                self.do(who, lambda tx: add_line(tx, self.parent, number, new))
            return
        self.do(who, lambda tx: add_line(tx, self.parent, number, new))
        self.model[number] = new_line(amount, "manual")
        self.changed(before)

    @rule(number=part, amount=quantity, who=user, stale=st.booleans())
    def edit(self, number: str, amount: float, who: str, stale: bool) -> None:
        """Another quantity; with an old version it is refused."""
        before = copy.deepcopy(self.model)
        expected = self.version - 1 if stale else self.version

        def change(tx: Any) -> Any:
            return change_line(tx, self.parent, number, {"quantity": amount}, expected)

        if stale or number not in self.model:
            with pytest.raises(VersionConflictError if stale else NotFoundError):
                self.do(who, change)
            return
        self.do(who, change)
        line = self.model[number]
        if amount == line["quantity"]:
            return
        if line["override"] and amount == line["cad"]:
            line |= {"source": "assembly", "override": False, "cad": None}
        elif line["source"] == "assembly":
            line |= {"source": "manual", "override": True, "cad": line["quantity"], "unreferenced": False}
        line["quantity"] = amount
        self.changed(before)

    @rule(number=part, who=user)
    def remove(self, number: str, who: str) -> None:
        """Take a line out."""
        before = copy.deepcopy(self.model)
        if number not in self.model:
            with pytest.raises(NotFoundError):
                self.do(who, lambda tx: remove_line(tx, self.parent, number))
            return
        self.do(who, lambda tx: remove_line(tx, self.parent, number))
        del self.model[number]
        self.changed(before)

    @rule(number=part, action=st.sampled_from(list(ReviewAction)), who=user)
    def decide(self, number: str, action: ReviewAction, who: str) -> None:
        """A decision of the merge page; refused where there is nothing to decide."""
        before = copy.deepcopy(self.model)
        line = self.model.get(number)
        open_now = self.open_conflicts()
        possible = line is not None and (
            action is ReviewAction.REMOVE
            or (action is ReviewAction.KEEP and line["unreferenced"])
            or (action in (ReviewAction.TAKE_CAD, ReviewAction.KEEP_SILO) and number in open_now)
        )
        decisions = [Decision(number, action, "because")]
        if not possible or line is None:
            with pytest.raises(RejectedError):
                self.do(who, lambda tx: resolve(tx, self.parent, decisions))
            return
        self.do(who, lambda tx: resolve(tx, self.parent, decisions))
        if action is ReviewAction.REMOVE or (action is ReviewAction.TAKE_CAD and open_now[number] == 0):
            del self.model[number]
        elif action is ReviewAction.KEEP:
            line |= {"source": "manual", "unreferenced": False}
        elif action is ReviewAction.TAKE_CAD:
            line |= {"quantity": open_now[number], "source": "assembly", "override": False, "cad": None}
        else:
            line |= {"override": False, "cad": None}
            self.accepted[number] = open_now[number]
        if before == self.model and action is not ReviewAction.REMOVE:
            # A reason was written on the line, which the model does not keep; it is a change anyway.
            self.version += self._version() - self.version
        self.changed(before)

    @precondition(lambda self: len(self.snapshots) > 1)
    @rule(data=st.data(), who=user)
    def restore(self, data: st.DataObject, who: str) -> None:
        """Any earlier state comes back, whole."""
        point = data.draw(st.sampled_from(sorted(self.snapshots)))
        self.do(who, lambda tx: restore_bom(tx, self.parent, point, None, None))
        self.model = copy.deepcopy(self.snapshots[point])
        self.version = self._version()
        self.changed(self.model)

    @precondition(lambda self: len(self.snapshots) > 1)
    @rule(data=st.data(), who=user)
    def undo(self, data: st.DataObject, who: str) -> None:
        """The newest change can always be undone; an older one is, or is refused and changes nothing."""
        points = sorted(self.snapshots)
        point = data.draw(st.sampled_from(points[1:]))
        before = copy.deepcopy(self.model)
        try:
            self.do(who, lambda tx: undo_change(tx, self.parent, point, None))
        except ConflictError:
            assert point != points[-1], "the newest change could not be undone"
            return
        if point == points[-1]:
            self.model = copy.deepcopy(self.snapshots[points[-2]])
        else:
            self.model = self._read()
        self.accepted = self._accepted()
        self.version = self._version()
        self.changed(before if before == self.model else self.model)

    def open_conflicts(self) -> dict[str, float]:
        """What the merge page would ask, by the model."""
        return {
            number: said
            for number, said in self.conflicts.items()
            if number in self.model
            and self.model[number]["source"] == "manual"
            and self.model[number]["quantity"] != said
            and self.accepted.get(number) != said
        }

    @invariant()
    def the_bom_is_the_model(self) -> None:
        """Lines, flags, owners and version."""
        if not hasattr(self, "model"):
            return
        assert self._read() == self.model
        assert self._version() == self.version

    @invariant()
    def the_history_adds_up(self) -> None:
        """The state at the newest change is the BOM; at any change it is what it was."""
        if not hasattr(self, "model"):
            return
        with self.db.read() as tx:
            parent = get_item(tx, self.parent)
            for point in list(self.snapshots)[-3:]:
                past = {p.child.part_number: told(p.state) for p in history.state_at(tx, parent, point)}
                assert past == self.snapshots[point]

    @invariant()
    def the_page_asks_what_the_model_asks(self) -> None:
        """Open conflicts."""
        if not hasattr(self, "model"):
            return
        with self.db.read() as tx:
            parent = get_item(tx, self.parent)
            found = open_conflicts(tx, parent, lines_of(tx, parent))
        assert {c.line.child_part_number: c.cad_quantity for c in found} == self.open_conflicts()

    def _read(self) -> Model:
        with self.db.read() as tx:
            lines = lines_of(tx, get_item(tx, self.parent))
            return {line.child_part_number: told(line.state) for line in lines}

    def _version(self) -> int:
        with self.db.read() as tx:
            return get_item(tx, self.parent).bom_version

    def _accepted(self) -> dict[str, float]:
        with self.db.read() as tx:
            parent = get_item(tx, self.parent)
            asked = {c.line.child_part_number for c in open_conflicts(tx, parent, lines_of(tx, parent))}
        return {number: said for number, said in self.accepted.items() if number not in asked}


def new_line(amount: float, source: str) -> dict[str, Any]:
    """A line of the model."""
    return {"quantity": amount, "source": source, "unreferenced": False, "override": False, "cad": None}


def told(state: Any) -> dict[str, Any]:
    """A stored line as the model has it."""
    return {
        "quantity": state.quantity,
        "source": state.source,
        "unreferenced": state.unreferenced_since is not None,
        "override": state.override,
        "cad": state.cad_quantity,
    }


@pytest.mark.slow
@pytest.mark.parametrize("kind", kinds("sqlite", "postgres"))
def test_the_server_behaves_like_the_model(kind: str) -> None:
    """Whatever several users do in whatever order, on both databases."""
    with tempfile.TemporaryDirectory() as folder:
        databases = Databases(Path(folder))
        db = Database(Settings(database_url=databases.new(kind), files_dir=Path(folder)))
        try:
            prepare(db, "silo_machine")
            with db.write() as tx:
                for number in PARTS:
                    create_item(tx, NewItem(part_number=number, name=number))
            machine = type("Machine", (Silo,), {"db": db})
            run_state_machine_as_test(
                machine,
                settings=settings(
                    max_examples=examples(6),
                    stateful_step_count=20,
                    suppress_health_check=list(HealthCheck),
                ),
            )
        finally:
            db.close()
            databases.close()
