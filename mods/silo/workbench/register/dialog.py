# SPDX-License-Identifier: LGPL-2.1-or-later
"""The Register Components dialog of spec bom-sync §6; it draws :mod:`silo.workbench.register.flow`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from silo.bom.errors import SiloError
from silo.registering.items import Registration
from silo.registering.offer import Offer
from silo.registering.request import RegistrationRequest
from silo.workbench.gui import widgets
from silo.workbench.gui.choices import KEY, ChoiceDelegate, choice_box, chosen_key, fill_choices
from silo.workbench.gui.qt import QShortcut, QtCore, QtGui, QtWidgets
from silo.workbench.register.rows import (
    APART,
    NEW,
    SAME,
    EditedRow,
    Filter,
    choose,
    filter_words,
    group,
    grouped,
    heading,
    headings,
    notices,
    number_texts,
    set_all,
    source_words,
    type_words,
)
from silo.workbench.tone import Tone
from silo.workbench.words import plain, spoken, tip, told_apart, translate, visible

if TYPE_CHECKING:
    from silo.workbench.register.flow import RegisterFlow

# Rows have buttons, and no user decides on a thousand parts at once; the next ones come after these.
MOST_ROWS = 400

COMPONENT, NAME, SOURCE, SUPPLIER, SUPPLIER_NUMBER, TYPE, CATEGORY, NUMBER, NOTE, BUTTON, NO_PART = range(11)
# What a user may write or choose in a cell: column → the attribute of the row.
_CELLS = {
    NAME: "name",
    SOURCE: "sourcing",
    SUPPLIER: "supplier",
    SUPPLIER_NUMBER: "supplier_part_number",
    TYPE: "item_type",
    CATEGORY: "category",
}
_PICTURE = 28


class RegisterDialog(QtWidgets.QDialog):  # type: ignore[misc]  # PySide has no types
    """Not modal: documents are opened and saved while it is there."""

    def __init__(self, title: str, path: str, flow: RegisterFlow, parent: Any, *, asks: bool) -> None:
        super().__init__(parent)
        self._path, self._flow = path, flow
        self.finished.connect(lambda _result: flow.closed(path))
        self._rows: list[EditedRow] = []
        self._offer = Offer((), {})
        self._types, self._sources = type_words(), source_words()
        self._categories: dict[str, str] = {}
        # How each row was drawn. Only what looks different is drawn again: there may be hundreds.
        self._drawn: dict[int, object] = {}
        # The place of each row in the table, between the headings of the sections; and back.
        self._places: list[int] = []
        self._row_at: dict[int, int] = {}
        self._filling = False
        self._headings: dict[int, str] = {}
        layout = widgets.lay_out(self, "SiloRegister", translate("Silo", "Register Components"), 1080, 480)
        self._title = title
        self._text = widgets.label(translate("Silo", "Looking for components without a part number…"))
        layout.addWidget(self._text)
        layout.addLayout(self._make_filters())
        self.table = self._make_table()
        layout.addWidget(self.table, 1)
        layout.addLayout(self._make_bulk())
        self._problem = widgets.label("", Tone.ERROR)
        self._problem.hide()
        layout.addWidget(self._problem)
        layout.addLayout(self._make_buttons(asks))
        self._enable()

    # -- made once --------------------------------------------------------------------------------------

    def _make_table(self) -> Any:
        table = QtWidgets.QTableWidget(0, 11)
        table.setObjectName("components")
        table.setHorizontalHeaderLabels(
            [
                translate("Silo", "Component"),
                translate("Silo", "Name"),
                translate("Silo", "Source"),
                translate("Silo", "Supplier"),
                translate("Silo", "Supplier's number"),
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
        view = QtWidgets.QAbstractItemView
        table.setSelectionBehavior(view.SelectionBehavior.SelectRows)
        # Not by any click: rows are chosen by clicks.
        triggers = view.EditTrigger
        table.setEditTriggers(
            triggers.DoubleClicked
            | triggers.SelectedClicked
            | triggers.EditKeyPressed
            | triggers.AnyKeyPressed
        )
        table.setIconSize(QtCore.QSize(_PICTURE, _PICTURE))
        table.itemSelectionChanged.connect(self._enable)
        # A view does not own its delegates.
        self._delegates = {
            SOURCE: ChoiceDelegate(lambda row: self._sources, table),
            TYPE: ChoiceDelegate(lambda row: self._types, table),
            CATEGORY: ChoiceDelegate(lambda row: self._categories, table, search=True),
            NUMBER: ChoiceDelegate(lambda place: self._rows[self._row_at[place]].choices(), table),
        }
        for column, delegate in self._delegates.items():
            table.setItemDelegateForColumn(column, delegate)
        table.itemChanged.connect(self._changed)
        return table

    def _make_filters(self) -> Any:
        self.words = widgets.field("words", translate("Silo", "Filter"), clear=True)
        self.words.textChanged.connect(lambda _text: self._filter())
        self.only = choice_box(None, filter_words())
        self.only.activated.connect(lambda _number: self._filter())
        texts = {
            "all": translate("Silo", "Check All"),
            "none": translate("Silo", "None"),
            "certain": translate("Silo", "All Certain"),
        }
        self.checks = {
            which: widgets.button(text, f"check-{which}", partial(self.check, which))
            for which, text in texts.items()
        }
        return widgets.row(self.words, self.only, *self.checks.values(), gap=6)

    def _make_bulk(self) -> Any:
        """Make the row of buttons that set one value for all chosen rows."""
        self.bulk: dict[str, Any] = {
            "sourcing": choice_box(None, self._sources),
            "category": choice_box(None, {}, search=True),
            "item_type": choice_box(None, self._types),
        }
        hints = {
            "sourcing": translate("Silo", "Source…"),
            "category": translate("Silo", "Category…"),
            "item_type": translate("Silo", "Type…"),
            "supplier": translate("Silo", "Supplier…"),
            "name": translate("Silo", "Name, as {name} left {n}"),
        }
        for column, box in self.bulk.items():
            box.activated.connect(partial(self._chosen_for_all, column))
            if box.isEditable():
                box.lineEdit().setPlaceholderText(hints[column])
                box.lineEdit().returnPressed.connect(partial(self._chosen_for_all, column))
            else:
                box.insertItem(0, hints[column], None)
            box.setMinimumWidth(160 if box.isEditable() else 0)
            self._reset(box)
        for column in ("supplier", "name"):
            line = self.bulk[column] = widgets.field("", hints[column])
            line.setMinimumWidth(170)
            line.returnPressed.connect(partial(self._chosen_for_all, column))
        self.fill_button = widgets.button(
            translate("Silo", "Fill Down"),
            "fill",
            self.fill_down,
            translate("Silo", "All chosen rows get what the first of them has in this column (Ctrl+D)"),
        )
        QShortcut(QtGui.QKeySequence("Ctrl+D"), self, self.fill_down)
        text = widgets.label(translate("Silo", "For the chosen rows:"), wrap=False)
        return widgets.row(text, *self.bulk.values(), self.fill_button, gap=6)

    def _make_buttons(self, asks: bool) -> Any:
        self.ask_again = QtWidgets.QCheckBox(translate("Silo", "Ask after each commit"))
        self.ask_again.setChecked(asks)
        self.ask_again.toggled.connect(lambda on: self._flow.ask_again(bool(on)))
        # No button of Return: that sets a value in a field above.
        self.register_button = widgets.button(
            translate("Silo", "Register Selected"), "register", self._register_checked
        )
        self.undo_button = widgets.button(
            translate("Silo", "Undo"),
            "undo",
            self._undo,
            translate(
                "Silo", "Undo the last registration: archive the new items and remove them from the files"
            ),
        )
        self.undo_button.hide()
        self.skip_button = widgets.button(translate("Silo", "Skip All"), "skip", self.close)
        return widgets.line(self.ask_again, None, self.undo_button, self.register_button, self.skip_button)

    # -- what is shown ----------------------------------------------------------------------------------

    @property
    def rows(self) -> Sequence[EditedRow]:
        """Return the rows as they are now."""
        return self._rows

    def fill(self, offer: Offer) -> None:
        """Show what can be registered."""
        self._offer = offer
        self.tell(notices(offer))
        self._categories = {
            code: f"{code} {plain(offer.categories[code], 60)}".strip()
            for code in dict.fromkeys((*offer.recent, *offer.categories))
        }
        fill_choices(self.bulk["category"], self._categories)
        self._reset(self.bulk["category"])
        self._drawn.clear()
        candidates = grouped(offer.candidates[:MOST_ROWS])
        names = told_apart(candidate.entry.doc_path for candidate in candidates)
        self._rows = [EditedRow.of(component, names[component.entry.doc_path]) for component in candidates]
        self._filling = True
        self._lay_out()
        for number, row in enumerate(self._rows):
            self._fill_row(self._places[number], row)
        self._filling = False
        self._refresh()
        widths = {COMPONENT: 230, NAME: 200, SOURCE: 90, TYPE: 90, CATEGORY: 200, NUMBER: 150}
        for column in (SUPPLIER, SUPPLIER_NUMBER):  # they come when a part is bought
            self.table.setColumnWidth(column, 120)
        for column, most in widths.items():
            self.table.resizeColumnToContents(column)
            self.table.setColumnWidth(column, min(self.table.columnWidth(column) + 14, most))
        mode = QtWidgets.QHeaderView.ResizeMode
        self.table.horizontalHeader().setSectionResizeMode(NOTE, mode.Stretch)
        for column in (BUTTON, NO_PART):
            self.table.horizontalHeader().setSectionResizeMode(column, mode.ResizeToContents)
        self.table.setColumnHidden(NO_PART, not any(row.is_modelled for row in self._rows))
        self.table.resizeRowsToContents()

    def _lay_out(self) -> None:
        """Lay out the rows with a heading above each section; without it if there are only components."""
        texts = headings(self._rows)
        # No heading if there are only components of one folder.
        with_headings = len(set(texts)) > 1 or any(row.section for row in self._rows)
        place, self._places, self._headings = 0, [], {}
        for number, text in enumerate(texts):
            if with_headings and (number == 0 or texts[number - 1] != text):
                self._headings[place] = text
                place += 1
            self._places.append(place)
            place += 1
        self._row_at = {place: number for number, place in enumerate(self._places)}
        self.table.clearSpans()
        self.table.setRowCount(place)
        for place, text in self._headings.items():
            heading = QtWidgets.QTableWidgetItem(text)
            widgets.embolden(heading)
            heading.setFlags(QtCore.Qt.ItemFlag.ItemIsEnabled)
            self.table.setItem(place, 0, heading)
            self.table.setSpan(place, 0, 1, self.table.columnCount())

    def _fill_row(self, number: int, row: EditedRow) -> None:
        for column in range(BUTTON):
            self.table.setItem(number, column, QtWidgets.QTableWidgetItem())
        entry = row.candidate.entry
        self.table.item(number, COMPONENT).setToolTip(tip(f"{entry.doc_path} · {entry.object_name}"))
        button = widgets.button(translate("Silo", "Register"), "", lambda: self._press(row))
        self.table.setCellWidget(number, BUTTON, button)
        if row.is_modelled:
            text = translate(
                "Silo",
                "Not listed again, here or on the command line; the file keeps this choice",
            )
            no_part = widgets.button(
                translate("Silo", "Not a Part"),
                "",
                lambda: self._flow.undeclare(self._path, row, no_part=True),
                text,
            )
            self.table.setCellWidget(number, NO_PART, no_part)

    def fail(self, error: SiloError) -> None:
        """Show why the components could not be looked up."""
        self._text.setText("")
        self.tell(str(error))

    def tell(self, text: str) -> None:
        """Show a problem, of one or more lines; "" removes it."""
        self._problem.setText(visible(spoken(text), 1000))
        self._problem.setVisible(bool(text))

    def registered(self, request: RegistrationRequest, result: Registration) -> None:
        """Show that a component was registered, or why it was not."""
        for row in self._rows:
            if row.candidate is request.candidate:
                row.result, row.running = result, False
                row.checked = row.checked and result.error is not None
        self._refresh()

    def undeclared(self, row: EditedRow, *, no_part: bool) -> None:
        """Show that the object is no longer declared: it is no part, or undecided."""
        if row in self._rows:
            article = row.candidate.article
            if article is not None:
                article = replace(article, entry=replace(article.entry, silo_uuid=None), no_part=no_part)
                row.candidate, row.checked = replace(row.candidate, article=article), False
            self._refresh()

    def taken_back(self, request: RegistrationRequest, error: SiloError | None) -> None:
        """Show that a registration was undone, or why it was not."""
        for row in self._rows:
            if row.candidate is request.candidate:
                row.result = Registration(request.proposal, error=error) if error is not None else None
                row.running, row.checked = False, False
        self._refresh()

    def show_pictures(self, pictures: Mapping[str, bytes]) -> None:
        """Show the pictures that FreeCAD keeps in the files."""
        self._filling = True
        for number, row in enumerate(self._rows):
            shown = QtGui.QPixmap()
            if shown.loadFromData(pictures.get(row.candidate.entry.doc_path, b"")):
                self.table.item(self._places[number], COMPONENT).setIcon(QtGui.QIcon(shown))
        self._filling = False

    def stopped(self) -> None:
        """Show that registering has ended."""
        for row in self._rows:
            row.running = False
        self._refresh()

    def set_number(self, category: str, number: str) -> None:
        """Show the next number of a category."""
        self._offer = replace(self._offer, numbers={**self._offer.numbers, category: number})
        self._refresh()

    def _refresh(self) -> None:
        self._filling = True
        texts = number_texts(self._rows, self._offer.numbers)
        for number, row in enumerate(self._rows):
            self._refresh_row(number, row, texts[number])
        bought = any(row.sourcing == "purchased" and not row.section for row in self._rows)
        for column in (SUPPLIER, SUPPLIER_NUMBER):
            self.table.setColumnHidden(column, not bought)
        self._filling = False
        more = len(self._offer.candidates) - len(self._rows)
        self._text.setText(heading(self._rows, self._title, more))
        self._enable()

    def _refresh_row(self, number: int, row: EditedRow, number_text: str) -> None:
        note, tone = row.note()
        category = self._categories.get(row.category, row.category)
        if row.guesses:
            category = translate("Silo", "guess: {category}", category=category)
        kind = self._types.get(row.item_type, row.item_type)
        source = self._sources[row.sourcing]
        supply = (row.supplier, row.supplier_part_number) if row.sourcing == "purchased" else ("", "")
        texts = (row.component(), row.name, source, *supply, kind, category, number_text, note)
        keys = {SOURCE: row.sourcing, TYPE: row.item_type, CATEGORY: row.category, NUMBER: row.number}
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

    def _filter(self) -> None:
        """Show the rows that fit, and the headings above them."""
        only, words = Filter(self.only.currentData()), self.words.text()
        shown = {
            place
            for place, row in zip(self._places, self._rows, strict=True)
            if row.fits(only, words) or row.running
        }
        below: set[int] = set()
        for place in range(self.table.rowCount() - 1, -1, -1):
            if place in self._headings:
                self.table.setRowHidden(place, not below)
                below.clear()
            else:
                self.table.setRowHidden(place, place not in shown)
                below |= {place} & shown

    def _visible(self) -> list[EditedRow]:
        pairs = zip(self._places, self._rows, strict=True)
        return [row for place, row in pairs if not self.table.isRowHidden(place)]

    def selected(self) -> list[EditedRow]:
        """Return the rows that a user has selected, from the top."""
        places = sorted({index.row() for index in self.table.selectionModel().selectedRows()})
        chosen = [self._rows[self._row_at[place]] for place in places if place in self._row_at]
        visible = self._visible()
        return [row for row in chosen if row in visible]

    def _enable(self) -> None:
        any_chosen = bool(self.table.selectionModel().selectedRows())
        for widget in (*self.bulk.values(), self.fill_button):
            widget.setEnabled(any_chosen)
        self.undo_button.setVisible(
            self._flow.can_take_back(self._path) and not any(row.running for row in self._rows)
        )
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
        elif column == NUMBER and chosen:
            choose(self._rows, row, chosen)
        elif column in (NAME, SUPPLIER, SUPPLIER_NUMBER):
            setattr(row, _CELLS[column], str(item.text()))
        elif column in _CELLS and chosen is not None:
            self._set([row], _CELLS[column], chosen)
        self._refresh()

    def _set(self, rows: Sequence[EditedRow], column: str, value: str) -> None:
        set_all(rows, column, value, self._offer.categories)
        for category in {row.category for row in rows}:
            self._need_number(category)
        self._refresh()

    def _chosen_for_all(self, column: str, _number: int = 0) -> None:
        box = self.bulk[column]
        if isinstance(box, QtWidgets.QLineEdit):
            value = box.text().strip()
            box.clear()
        else:
            value = chosen_key(box)
            self._reset(box)
        if value is not None and (value or column == "sourcing"):
            self._set(self.selected(), column, value)

    def _reset(self, box: Any) -> None:
        box.setCurrentIndex(-1 if box.isEditable() else 0)
        if box.isEditable():
            box.clearEditText()

    def fill_down(self) -> None:
        """Copy the first chosen row's value in the current column to all chosen rows."""
        rows, column = self.selected(), _CELLS.get(self.table.currentColumn(), "category")
        if rows:
            self._set(rows[1:], column, getattr(rows[0], column))

    def check(self, which: str) -> None:
        """Check all rows that are shown, none of them, or all that are certain."""
        for row in self._visible():
            certain = row.candidate.wanted or row.checked
            row.checked = row.can_register and (which == "all" or (which == "certain" and certain))
        self._refresh()

    def _undo(self) -> None:
        for row in self._rows:
            row.running = row.finished and row.number != SAME
        self._refresh()
        self._flow.take_back(self._path)

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
        # The choice to keep holds for all files of an identity together, or for none.
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
            if row.number not in (NEW, APART) and row.request().existing is None:
                row.number = NEW
        self._refresh()
        self._flow.register(self._path, [row.request() for row in ready])


def _button_text(row: EditedRow) -> str:
    if row.can_keep:
        return translate("Silo", "Keep")
    if row.can_undeclare:
        no_part = row.section == "no part"
        return translate("Silo", "Take Back") if no_part else translate("Silo", "Undeclare")
    is_modelled = row.section == "modelled"
    return translate("Silo", "Declare") if is_modelled else translate("Silo", "Register")


def _flags(row: EditedRow, column: int) -> Any:
    """Return what a user can do with a cell, as Qt's flags."""
    flag = QtCore.Qt.ItemFlag
    flags = flag.ItemIsEnabled | flag.ItemIsSelectable
    is_supply = column in (SUPPLIER, SUPPLIER_NUMBER)
    writable = column in _CELLS and not (is_supply and row.sourcing != "purchased")
    if (row.editable and writable) or (row.can_choose and column == NUMBER):
        flags |= flag.ItemIsEditable
    if column == COMPONENT and (row.can_register or row.can_keep):
        flags |= flag.ItemIsUserCheckable
    return flags
