# SPDX-License-Identifier: LGPL-2.1-or-later
"""The Register Components dialog of spec bom-sync §6; it draws :mod:`silo.workbench.register.flow`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from silo.bom.errors import SiloError
from silo.registering.items import Registration
from silo.registering.offer import Offer
from silo.registering.orders import Order
from silo.workbench.gui import widgets
from silo.workbench.gui.qt import QtCore, QtWidgets
from silo.workbench.gui.widgets import KEY, ChoiceDelegate
from silo.workbench.pane.activity import Tone
from silo.workbench.register.flow import (
    APART,
    NEW,
    EditedRow,
    choose,
    group,
    heading,
    notices,
    number_texts,
    retype,
    section_words,
    type_words,
)
from silo.workbench.words import plain, tip, told_apart, translate, visible

if TYPE_CHECKING:
    from silo.workbench.register.flow import RegisterFlow

# Rows have buttons, and nobody decides on a thousand parts at once; the next ones come after these.
MOST_ROWS = 400

COMPONENT, NAME, TYPE, CATEGORY, NUMBER, NOTE, BUTTON, NO_PART = range(8)


class RegisterDialog(QtWidgets.QDialog):  # type: ignore[misc]  # PySide has no types
    """Not modal: documents are opened and saved while it is there."""

    def __init__(self, title: str, path: str, flow: RegisterFlow, parent: Any, *, asks: bool) -> None:
        super().__init__(parent)
        self._path, self._flow = path, flow
        self.finished.connect(lambda _result: flow.closed(path))
        self._rows: list[EditedRow] = []
        self._offer = Offer((), {})
        self._types = type_words()
        self._categories: dict[str, str] = {}
        # How each row was drawn. Only what looks different is drawn anew: there may be hundreds.
        self._drawn: dict[int, object] = {}
        # Where in the table each row stands, between the headings of the sections; and back.
        self._places: list[int] = []
        self._row_at: dict[int, int] = {}
        self._filling = False
        layout = widgets.lay_out(self, "SiloRegister", translate("Silo", "Register Components"), 1080, 480)
        self._title = title
        self._text = widgets.label(translate("Silo", "Looking for components without a part number…"))
        layout.addWidget(self._text)
        self.table = self._make_table()
        layout.addWidget(self.table, 1)
        self._problem = widgets.label("", Tone.ERROR)
        self._problem.hide()
        layout.addWidget(self._problem)
        layout.addLayout(self._make_buttons(asks))
        self._enable()

    # -- made once --------------------------------------------------------------------------------------

    def _make_table(self) -> Any:
        table = QtWidgets.QTableWidget(0, 8)
        table.setObjectName("components")
        table.setHorizontalHeaderLabels(
            [
                translate("Silo", "Component"),
                translate("Silo", "Name"),
                translate("Silo", "Type"),
                translate("Silo", "Category"),
                translate("Silo", "Part number"),
                translate("Silo", "Remarks"),
                "",
                "",
            ]
        )
        table.verticalHeader().hide()
        table.setWordWrap(True)
        table.setSelectionBehavior(QtWidgets.QAbstractItemView.SelectionBehavior.SelectRows)
        table.setEditTriggers(QtWidgets.QAbstractItemView.EditTrigger.AllEditTriggers)
        # A view does not own its delegates.
        self._delegates = {
            TYPE: ChoiceDelegate(lambda row: self._types, table),
            CATEGORY: ChoiceDelegate(lambda row: self._categories, table),
            NUMBER: ChoiceDelegate(lambda place: self._rows[self._row_at[place]].choices(), table),
        }
        for column, delegate in self._delegates.items():
            table.setItemDelegateForColumn(column, delegate)
        table.itemChanged.connect(self._changed)
        return table

    def _make_buttons(self, asks: bool) -> Any:
        self.ask_again = QtWidgets.QCheckBox(translate("Silo", "Ask after each commit"))
        self.ask_again.setChecked(asks)
        self.ask_again.toggled.connect(lambda on: self._flow.ask_again(bool(on)))
        self.register_button = widgets.button(
            translate("Silo", "Register Selected"), "register", self._register_checked, default=True
        )
        self.skip_button = widgets.button(translate("Silo", "Skip All"), "skip", self.close)
        return widgets.line(self.ask_again, None, self.register_button, self.skip_button)

    # -- what is shown ----------------------------------------------------------------------------------

    @property
    def rows(self) -> Sequence[EditedRow]:
        """The rows as they stand."""
        return self._rows

    def fill(self, offer: Offer) -> None:
        """Show what can be registered."""
        self._offer = offer
        self.tell(notices(offer))
        self._categories = {
            code: f"{code} {plain(text, 60)}".strip() for code, text in offer.categories.items()
        }
        self._drawn.clear()
        candidates = offer.candidates[:MOST_ROWS]
        names = told_apart(candidate.entry.doc_path for candidate in candidates)
        self._rows = [EditedRow.of(one, names[one.entry.doc_path]) for one in candidates]
        self._filling = True
        self._lay_out()
        for number, row in enumerate(self._rows):
            self._fill_row(self._places[number], row)
        self._filling = False
        self._refresh()
        for column, most in ((COMPONENT, 230), (NAME, 220), (TYPE, 110), (CATEGORY, 220), (NUMBER, 170)):
            self.table.resizeColumnToContents(column)
            self.table.setColumnWidth(column, min(self.table.columnWidth(column) + 14, most))
        mode = QtWidgets.QHeaderView.ResizeMode
        self.table.horizontalHeader().setSectionResizeMode(NOTE, mode.Stretch)
        for column in (BUTTON, NO_PART):
            self.table.horizontalHeader().setSectionResizeMode(column, mode.ResizeToContents)
        self.table.setColumnHidden(NO_PART, all(row.candidate.article is None for row in self._rows))
        self.table.resizeRowsToContents()

    def _lay_out(self) -> None:
        """A heading before each section; none where there is only the one of components."""
        sections = [row.section for row in self._rows]
        with_headings = bool(set(sections) - {""})
        place, self._places, headings = 0, [], {}
        for number, section in enumerate(sections):
            if with_headings and (number == 0 or sections[number - 1] != section):
                headings[place] = section_words()[section]
                place += 1
            self._places.append(place)
            place += 1
        self._row_at = {place: number for number, place in enumerate(self._places)}
        self.table.clearSpans()
        self.table.setRowCount(place)
        for place, text in headings.items():
            heading = QtWidgets.QTableWidgetItem(text)
            widgets.embolden(heading)
            heading.setFlags(QtCore.Qt.ItemFlag.ItemIsEnabled)
            self.table.setItem(place, 0, heading)
            self.table.setSpan(place, 0, 1, self.table.columnCount())

    def _fill_row(self, number: int, row: EditedRow) -> None:
        for column in range(6):
            self.table.setItem(number, column, QtWidgets.QTableWidgetItem())
        entry = row.candidate.entry
        self.table.item(number, COMPONENT).setToolTip(tip(f"{entry.doc_path} · {entry.object_name}"))
        button = widgets.button(translate("Silo", "Register"), "", lambda: self._press(row))
        self.table.setCellWidget(number, BUTTON, button)
        if row.candidate.article is not None:
            text = translate(
                "Silo", "It is not listed again, here or by the command line; the file keeps that"
            )
            no_part = widgets.button(
                translate("Silo", "Not a Part"),
                "",
                lambda: self._flow.undeclare(self._path, row, no_part=True),
                text,
            )
            self.table.setCellWidget(number, NO_PART, no_part)

    def fail(self, error: SiloError) -> None:
        """The components could not be looked up."""
        self._text.setText("")
        self.tell(str(error))

    def tell(self, text: str) -> None:
        """Show a problem, of one or more lines; "" takes it away."""
        self._problem.setText(visible(text, 1000))
        self._problem.setVisible(bool(text))

    def registered(self, order: Order, result: Registration) -> None:
        """One component is registered, or could not be."""
        for row in self._rows:
            if row.candidate is order.candidate:
                row.result, row.running = result, False
                row.checked = row.checked and result.error is not None
        self._refresh()

    def undeclared(self, row: EditedRow, *, no_part: bool) -> None:
        """It is no component any more: no part, or undecided."""
        if row in self._rows:
            article = row.candidate.article
            if article is not None:
                article = replace(article, entry=replace(article.entry, silo_uuid=None), no_part=no_part)
                row.candidate, row.checked = replace(row.candidate, article=article), False
            self._refresh()

    def stopped(self) -> None:
        """Nothing is being registered any more."""
        for row in self._rows:
            row.running = False
        self._refresh()

    def set_number(self, category: str, number: str) -> None:
        """The next number of a category is known."""
        self._offer = replace(self._offer, numbers={**self._offer.numbers, category: number})
        self._refresh()

    def _refresh(self) -> None:
        self._filling = True
        texts = number_texts(self._rows, self._offer.numbers)
        for number, row in enumerate(self._rows):
            self._refresh_row(number, row, texts[number])
        self._filling = False
        more = len(self._offer.candidates) - len(self._rows)
        self._text.setText(heading(self._rows, self._title, more))
        self._enable()

    def _refresh_row(self, number: int, row: EditedRow, number_text: str) -> None:
        note, tone = row.note()
        category = self._categories.get(row.category, row.category)
        if row.guesses:
            category = translate("Silo", "guess: {category}").replace("{category}", category)
        kind = self._types.get(row.item_type, row.item_type)
        texts = (row.component(), row.name, kind, category, number_text, note)
        keys = {TYPE: row.item_type, CATEGORY: row.category, NUMBER: row.number}
        can = (row.editable, row.can_choose, row.can_register, row.can_keep, row.can_undeclare, row.section)
        look = (texts, keys, tone, can, row.checked)
        if self._drawn.get(number) == look:
            return
        self._drawn[number] = look
        place = self._places[number]
        for column, text in enumerate(texts):
            item = self.table.item(place, column)
            item.setText(text)
            item.setData(KEY, keys.get(column))
            item.setFlags(_flags(row, column))
        state = QtCore.Qt.CheckState.Checked if row.checked else QtCore.Qt.CheckState.Unchecked
        self.table.item(place, COMPONENT).setCheckState(state)
        remark = self.table.item(place, NOTE)
        remark.setToolTip(tip(note))
        remark.setForeground(widgets.brush(tone, self.table))
        button = self.table.cellWidget(place, BUTTON)
        button.setText(_button_text(row))
        button.setEnabled(row.can_register or row.can_keep or row.can_undeclare)
        if (no_part := self.table.cellWidget(place, NO_PART)) is not None:
            no_part.setVisible(row.can_be_no_part)

    def _enable(self) -> None:
        chosen = any(row.checked and (row.can_register or row.can_keep) for row in self._rows)
        self.register_button.setEnabled(chosen)
        done = bool(self._rows) and all(row.finished for row in self._rows)
        text = translate("Silo", "Close") if done or not self._rows else translate("Silo", "Skip All")
        self.skip_button.setText(text)

    # -- what the person does ---------------------------------------------------------------------------

    def _changed(self, item: Any) -> None:
        if self._filling:
            return
        if item.row() not in self._row_at:
            return
        row, column = self._rows[self._row_at[item.row()]], item.column()
        chosen = item.data(QtCore.Qt.ItemDataRole.UserRole)
        if column == COMPONENT:
            row.checked = item.checkState() == QtCore.Qt.CheckState.Checked
        elif column == NAME:
            row.name = str(item.text())
        elif column == TYPE and chosen:
            retype(row, chosen, self._offer.categories)
            self._need_number(row.category)
        elif column == NUMBER and chosen:
            choose(self._rows, row, chosen)
        elif column == CATEGORY and chosen:
            row.category, row.checked = chosen, row.can_register
            self._need_number(chosen)
        self._refresh()

    def _need_number(self, category: str) -> None:
        if category not in self._offer.numbers:
            self._flow.number(self._path, category)

    def _press(self, row: EditedRow) -> None:
        if row.can_undeclare:
            self._flow.undeclare(self._path, row)
        else:
            self._carry_out([row])

    def _register_checked(self) -> None:
        self._carry_out([row for row in self._rows if row.checked])

    def _carry_out(self, rows: Sequence[EditedRow]) -> None:
        # Keeping is said of all files of an identity together, or it is said of none.
        kept = {id(other): other for row in rows if row.can_keep for other in group(self._rows, row)}
        if same := [row for row in kept.values() if row.can_keep]:
            self._flow.same(same)
            for row in same:
                row.keep()
            self._refresh()
        self._register([row for row in rows if row.can_register])

    def _register(self, rows: Sequence[EditedRow]) -> None:
        ready = [row for row in rows if row.can_register]
        if not ready:
            return
        self.tell("")
        for row in ready:
            row.running, row.result = True, None
            if row.number not in (NEW, APART) and row.order().existing is None:
                row.number = NEW
        self._refresh()
        self._flow.register(self._path, [row.order() for row in ready])


def _button_text(row: EditedRow) -> str:
    if row.can_keep:
        return translate("Silo", "Keep")
    if row.can_undeclare:
        no_part = row.section == "no part"
        return translate("Silo", "Take Back") if no_part else translate("Silo", "Undeclare")
    is_modelled = row.section == "modelled"
    return translate("Silo", "Declare") if is_modelled else translate("Silo", "Register")


def _flags(row: EditedRow, column: int) -> Any:
    """What a person can do with a cell."""
    flag = QtCore.Qt.ItemFlag
    flags = flag.ItemIsEnabled | flag.ItemIsSelectable
    if (row.editable and column in (NAME, TYPE, CATEGORY)) or (row.can_choose and column == NUMBER):
        flags |= flag.ItemIsEditable
    if column == COMPONENT and (row.can_register or row.can_keep):
        flags |= flag.ItemIsUserCheckable
    return flags
