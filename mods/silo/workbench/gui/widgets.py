# SPDX-License-Identifier: LGPL-2.1-or-later
"""Small widgets that the pane and the dialogs share. Text is always shown as text, never as markup.

A layout that puts widgets side by side and begins a new line where the width ends (Qt has none).

A table cell with a choice: text with a small arrow, a list when one clicks on it.

FreeCAD is about to close: what must be done before its documents are gone, and the wait for the disk.

FreeCAD 0.20's own save, for any document: the one way there to take the mark of unsaved edits away.

It is a message to a 3D view. A document that a link has loaded has no view, so it gets one for the moment
(0.3 s, measured). FreeCAD asks whether to save the files below as well; the answer is no, for the caller
this decides about each file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from silo.workbench import words
from silo.workbench.freecad import host
from silo.workbench.gui.qt import QtCore, QtGui, QtWidgets, run_dialog
from silo.workbench.tone import Tone
from silo.workbench.words import translate

# (on a light ground, on a dark ground)
_COLOURS = {
    Tone.GOOD: ("#1f7a33", "#6fcf85"),
    Tone.CHANGED: ("#8a5a00", "#f0bd59"),
    Tone.WARNING: ("#a34a00", "#ffa94d"),
    Tone.ERROR: ("#b3202c", "#ff7b85"),
}


def is_dark(widget: Any) -> bool:
    """Return True if the widget's ground is dark (FreeCAD's dark themes).

    It looks at the colour of the text, since a theme that is a style sheet does not change the palette's
    ground.
    """
    widget.ensurePolished()
    return bool(widget.palette().color(QtGui.QPalette.ColorRole.WindowText).lightness() > 128)


def colour(tone: Tone, widget: Any) -> str:
    """Return the colour of a tone that is readable on the widget's ground; "" for the theme's own."""
    if tone is Tone.QUIET:
        widget.ensurePolished()
        text = widget.palette().color(QtGui.QPalette.ColorRole.WindowText)
        ground = widget.palette().color(QtGui.QPalette.ColorRole.Window)
        parts = [
            round(0.62 * t + 0.38 * g) for t, g in zip(text.getRgb()[:3], ground.getRgb()[:3], strict=True)
        ]
        return "#{:02x}{:02x}{:02x}".format(*parts)
    light, dark = _COLOURS.get(tone, ("", ""))
    return dark if is_dark(widget) else light


def label(text: str, tone: Tone = Tone.PLAIN, *, bold: bool = False, wrap: bool = True) -> Any:
    """Make a label of plain text, which wraps, and can be selected and copied."""
    made = QtWidgets.QLabel()
    made.setTextFormat(QtCore.Qt.TextFormat.PlainText)
    made.setText(words.breakable(text) if wrap else text)
    made.setWordWrap(wrap)
    made.setTextInteractionFlags(QtCore.Qt.TextInteractionFlag.TextSelectableByMouse)
    if wrap:
        # One word without a blank, however long, must not widen the whole pane.
        policy = made.sizePolicy()
        policy.setHorizontalPolicy(QtWidgets.QSizePolicy.Policy.Ignored)
        made.setSizePolicy(policy)
        made.setMinimumWidth(20)
    paint(made, tone, bold=bold)
    return made


def paint(made: Any, tone: Tone, *, bold: bool = False) -> None:
    """Give a label the colour of a tone, even if it has that of another tone."""
    # Its own colour is in its palette, and would be taken for that of the theme.
    made.setStyleSheet("")
    rules = []
    if chosen := colour(tone, made):
        rules.append(f"color: {chosen};")
    if bold:
        rules.append("font-weight: bold;")
    made.setStyleSheet("QLabel { " + " ".join(rules) + " }" if rules else "")


def link_button(text: str, call: Callable[[], None], tip: str = "") -> Any:
    """Make a button that looks like a link: it is not loud, and the keyboard reaches it."""
    made = QtWidgets.QPushButton(text)
    made.setFlat(True)
    made.setCursor(QtCore.Qt.CursorShape.PointingHandCursor)
    # By a label: some themes give buttons a light text on grounds of their own, which ours does not have.
    made.setStyleSheet(link_style("#7cb7ff" if is_dark(QtWidgets.QLabel()) else "#0b5cad"))
    made.setSizePolicy(QtWidgets.QSizePolicy.Policy.Fixed, QtWidgets.QSizePolicy.Policy.Fixed)
    made.setToolTip(words.tip(tip))
    made.clicked.connect(lambda _checked=False: call())
    return made


def link_style(shade: str, more: str = "") -> str:
    """Write the style sheet of a link, which must undo what FreeCAD's themes do to buttons."""
    return (
        f"QPushButton {{ color: {shade}; background: transparent; border: none; min-width: 0; min-height: 0;"
        f" margin: 0; padding: 1px 2px; text-align: left; {more} }}"
        "QPushButton:hover, QPushButton:focus { text-decoration: underline; }"
    )


def brush(tone: Tone, widget: Any) -> Any:
    """Make a brush in the colour of a tone for a cell; in the theme's own colour if the tone has none."""
    shade = colour(tone, widget)
    return QtGui.QBrush(QtGui.QColor(shade)) if shade else QtGui.QBrush()


def button(text: str, name: str, call: Callable[[], object], tip: str = "", *, default: bool = False) -> Any:
    """Make a push button; the Return key presses only the default button of a window."""
    made = QtWidgets.QPushButton(text)
    made.setObjectName(name)
    made.setAutoDefault(default)
    made.setDefault(default)
    made.setToolTip(words.tip(tip))
    made.clicked.connect(lambda _checked=False: call())
    return made


def field(name: str, hint: str = "", *, clear: bool = False) -> Any:
    """Make a field for a line of text; ``clear``: with a button that empties it."""
    made = QtWidgets.QLineEdit()
    made.setObjectName(name)
    made.setPlaceholderText(hint)
    made.setClearButtonEnabled(clear)
    return made


def line(*parts: Any) -> Any:
    """Make a layout of widgets in one line; those after None are at the right."""
    layout = QtWidgets.QHBoxLayout()
    for part in parts:
        layout.addStretch(1) if part is None else layout.addWidget(part)
    return layout


def lay_out(window: Any, name: str, title: str, width: int, height: int, *, modal: bool = False) -> Any:
    """Give a window its name and size; returns the layout of its content.

    modal
        the caller waits for the window, and deletes it afterwards; other windows are deleted when they are
        closed.
    """
    window.setObjectName(name)
    window.setWindowTitle(title)
    window.setAttribute(QtCore.Qt.WidgetAttribute.WA_DeleteOnClose, not modal)
    screen = QtGui.QGuiApplication.primaryScreen().availableGeometry()
    window.resize(min(width, screen.width() - 20), min(height, screen.height() - 40))
    layout = QtWidgets.QVBoxLayout(window)
    layout.setSpacing(8)
    return layout


def tree(name: str, headings: Sequence[str], numbers: Sequence[int] = (), *, flat: bool = True) -> Any:
    """Make a table of lines, or of lines below lines; the columns ``numbers`` are flush right."""
    made = QtWidgets.QTreeWidget()
    made.setObjectName(name)
    made.setRootIsDecorated(not flat)
    made.setHeaderLabels(list(headings))
    for column in numbers:
        made.headerItem().setTextAlignment(column, QtCore.Qt.AlignmentFlag.AlignRight)
    return made


def embolden(item: Any) -> None:
    """Write the first cell of a line in bold letters."""
    # A line of a tree has a font for each column, a cell of a table its own.
    where = (0,) if isinstance(item, QtWidgets.QTreeWidgetItem) else ()
    font = item.font(*where)
    font.setBold(True)
    item.setFont(*where, font)


def row(*widgets: Any, gap: int = 10) -> Any:
    """Make a layout of widgets side by side, in several lines if they need more width."""
    layout = FlowLayout(gap)
    for widget in widgets:
        layout.addWidget(widget)
    return layout


def picture(name: str, size: int = 16) -> Any:
    """Make a label with one of the add-on's own icons."""
    made = QtWidgets.QLabel()
    icon = host.icon(name)
    if icon is not None:
        made.setPixmap(icon.pixmap(size, size))
    made.setFixedSize(size, size)
    return made


def broken(text: str, metrics: Any, width: int) -> str:
    """Break a text into lines of at most ``width`` pixels; a wider word has a line of its own."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and metrics.horizontalAdvance(longer) > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return "\n".join(lines)


def clear(layout: Any) -> None:
    """Remove all widgets of a layout."""
    while layout.count():
        item = layout.takeAt(0)
        if item.widget() is not None:
            item.widget().hide()
            item.widget().deleteLater()
        elif item.layout() is not None:
            clear(item.layout())


def read(parent: Any, title: str, lines: Iterable[str]) -> None:
    """Show all lines of a long text in a window that scrolls, and wait until it is closed."""
    window = QtWidgets.QDialog(parent)
    layout = lay_out(window, "SiloRead", title, 620, 420, modal=True)
    text = QtWidgets.QPlainTextEdit("\n".join(words.plain(line, 1000) for line in lines))
    text.setReadOnly(True)
    layout.addWidget(text)
    layout.addLayout(
        line(None, button(words.translate("Silo", "Close"), "close", window.accept, default=True))
    )
    run_dialog(window)
    window.deleteLater()


def _message(parent: Any, title: str, text: str) -> Any:
    box = QtWidgets.QMessageBox(parent)
    box.setIcon(QtWidgets.QMessageBox.Icon.Warning)
    box.setWindowTitle(title)
    box.setTextFormat(QtCore.Qt.TextFormat.PlainText)
    box.setText(words.visible(words.spoken(text), 2000))
    return box


def warn(parent: Any, title: str, text: str) -> None:
    """Show a problem, and wait until the person closes it."""
    run_dialog(_message(parent, title, text))


def confirm(parent: Any, title: str, text: str, yes: str, no: str) -> bool:
    """Ask a question with two answers; ``no`` is the harmless answer, also of Return and Escape."""
    box = _message(parent, title, text)
    box.setObjectName("SiloConfirm")
    wanted = box.addButton(yes, QtWidgets.QMessageBox.ButtonRole.DestructiveRole)
    harmless = box.addButton(no, QtWidgets.QMessageBox.ButtonRole.RejectRole)
    box.setDefaultButton(harmless)
    box.setEscapeButton(harmless)
    run_dialog(box)
    return bool(box.clickedButton() == wanted)


class FlowLayout(QtWidgets.QLayout):  # type: ignore[misc]  # PySide has no types
    """Left to right, then down. ``gap`` is between neighbours and between lines, in pixels."""

    def __init__(self, gap: int = 8) -> None:
        super().__init__()
        self._items: list[Any] = []
        self._gap = gap
        self.setContentsMargins(0, 0, 0, 0)

    def addItem(self, item: Any) -> None:
        """Take the item that Qt passes on from :meth:`addWidget`."""
        self._items.append(item)

    def count(self) -> int:
        """Return the number of widgets."""
        return len(self._items)

    def itemAt(self, number: int) -> Any:
        """Return the widget's item with this number; None beyond the last."""
        return self._items[number] if 0 <= number < len(self._items) else None

    def takeAt(self, number: int) -> Any:
        """Remove an item and return it."""
        return self._items.pop(number) if 0 <= number < len(self._items) else None

    def hasHeightForWidth(self) -> bool:
        """Return True: a narrower layout is higher."""
        return True

    def heightForWidth(self, width: int) -> int:
        """Return the height that a width needs."""
        return self._place(QtCore.QRect(0, 0, width, 0), move=False)

    def setGeometry(self, area: Any) -> None:
        """Place the widgets."""
        super().setGeometry(area)
        self._place(area, move=True)

    def sizeHint(self) -> Any:
        """Return the smallest size, since the width comes from outside."""
        return self.minimumSize()

    def minimumSize(self) -> Any:
        """Return the size of the largest widget."""
        size = QtCore.QSize()
        for item in self._items:
            size = size.expandedTo(item.minimumSize())
        return size

    def _place(self, area: Any, *, move: bool) -> int:
        x, y, line = area.x(), area.y(), 0
        for item in self._items:
            hint = item.sizeHint()
            if x > area.x() and x + hint.width() > area.right() + 1:
                x, y, line = area.x(), y + line + self._gap // 2, 0
            if move:
                item.setGeometry(QtCore.QRect(QtCore.QPoint(x, y), hint))
            x += hint.width() + self._gap
            line = max(line, hint.height())
        return int(y + line - area.y())


def choice_box(parent: Any, choices: Mapping[str, str], *, search: bool = False, name: str = "") -> Any:
    """Make a list of choices, no longer than the screen; with ``search``, typed letters filter it."""
    box = QtWidgets.QComboBox(parent)
    box.setObjectName(name)
    box.setMaxVisibleItems(14)
    box.setStyleSheet("QComboBox { combobox-popup: 0; }")  # else some styles show all of them at once
    fill_choices(box, choices)
    if search:
        box.setEditable(True)
        box.setInsertPolicy(QtWidgets.QComboBox.InsertPolicy.NoInsert)
        box.completer().setFilterMode(QtCore.Qt.MatchFlag.MatchContains)
        box.completer().setCompletionMode(QtWidgets.QCompleter.CompletionMode.PopupCompletion)
    return box


def fill_choices(box: Any, choices: Mapping[str, str]) -> None:
    """Fill a list with these choices."""
    box.clear()
    for key, text in choices.items():
        box.addItem(text, key)


def chosen_key(box: Any) -> Any:
    """Return the key of the chosen or typed text; None if the letters fit several choices, or none."""
    typed = box.currentText()
    if not box.isEditable() or typed == box.itemText(box.currentIndex()):
        return box.currentData()
    texts = [box.itemText(number) for number in range(box.count())]
    fitting = [number for number, text in enumerate(texts) if typed and typed.casefold() in text.casefold()]
    return box.itemData(fitting[0]) if len(fitting) == 1 else None


# The cell's data that holds the key of what is chosen now.
KEY = QtCore.Qt.ItemDataRole.UserRole + 1


class ChoiceDelegate(QtWidgets.QStyledItemDelegate):  # type: ignore[misc]  # PySide has no types
    """Edits a cell by choosing; a newly chosen key is set as ``UserRole``, the text is what is shown.

    The cell holds the present key as :data:`KEY`, which need not be one that can be chosen.

    choices
        row → {key: text}.
    search
        typed letters filter the choices.
    """

    def __init__(
        self, choices: Callable[[int], dict[str, str]], parent: Any, *, search: bool = False
    ) -> None:
        super().__init__(parent)
        self._choices, self._search = choices, search

    def createEditor(self, parent: Any, _option: Any, index: Any) -> Any:
        """Make a list of the choices, and open it at once."""
        box = choice_box(parent, self._choices(index.row()), search=self._search)
        box.activated.connect(lambda _number: self._chosen(box))

        def show() -> None:
            if self._search:
                box.lineEdit().selectAll()
                box.completer().setCompletionPrefix("")
                box.completer().complete()
            else:
                box.showPopup()

        QtCore.QTimer.singleShot(0, show)
        return box

    def setEditorData(self, editor: Any, index: Any) -> None:
        """Begin with the present choice."""
        editor.setCurrentIndex(editor.findData(index.data(KEY)))

    def setModelData(self, editor: Any, model: Any, index: Any) -> None:
        """Take over the choice."""
        key = chosen_key(editor)
        if key is not None and key != index.data(KEY):
            model.setData(index, key, QtCore.Qt.ItemDataRole.UserRole)

    def paint(self, painter: Any, option: Any, index: Any) -> None:
        """Paint the text, and an arrow if a person can choose."""
        super().paint(painter, option, index)
        if not index.flags() & QtCore.Qt.ItemFlag.ItemIsEditable:
            return
        area = option.rect
        middle = area.center().y()
        right = area.right() - 6
        arrow = QtGui.QPolygon(
            [
                QtCore.QPoint(right - 8, middle - 2),
                QtCore.QPoint(right, middle - 2),
                QtCore.QPoint(right - 4, middle + 3),
            ]
        )
        painter.save()
        painter.setRenderHint(QtGui.QPainter.RenderHint.Antialiasing)
        painter.setPen(QtCore.Qt.PenStyle.NoPen)
        painter.setBrush(option.palette.color(QtGui.QPalette.ColorRole.Text))
        painter.drawPolygon(arrow)
        painter.restore()

    def _chosen(self, box: Any) -> None:
        self.commitData.emit(box)
        self.closeEditor.emit(box)


# A bar that is visible only for a moment would flicker.
PATIENCE_S = 0.3
STEP_S = 0.05


class CloseWatch(QtCore.QObject):  # type: ignore[misc]  # PySide has no types
    """Calls ``before`` when a window is asked to close, before it does anything about it."""

    def __init__(self, window: Any, before: Callable[[], None]) -> None:
        super().__init__(window)
        self._before = before
        window.installEventFilter(self)

    def eventFilter(self, _watched: Any, event: Any) -> bool:
        """Pass each event on."""
        if event.type() == QtCore.QEvent.Type.Close:
            self._before()
        return False


def wait_for_disk(left: Callable[[float], int]) -> None:
    """Wait until nothing remains; after a moment with a bar, and a button to close anyway.

    left
        waits at most so many seconds, and returns how many files are still to be written.
    """
    most = left(PATIENCE_S)
    if not most:
        return
    window = QtWidgets.QProgressDialog()
    window.setObjectName("SiloClosing")
    window.setWindowTitle(translate("Silo", "Silo"))
    window.setLabelText(
        translate(
            "Silo",
            "Your commits are being copied to the outbox. They are sent when FreeCAD is started the next "
            "time.\n"
            "Commits that are not copied by then may have to be committed again.",
        )
    )
    window.setCancelButtonText(translate("Silo", "Close without waiting"))
    window.setMinimumDuration(0)
    window.setRange(0, most)
    window.show()
    while (count := left(STEP_S)) and not window.wasCanceled():
        window.setRange(0, max(most, count))
        window.setValue(max(0, most - count))
        QtWidgets.QApplication.processEvents()
    window.hide()
    window.deleteLater()


def save_in_view(doc: Any) -> None:
    """Save a document that has a file."""
    view = host.view_of(doc)
    with _answering_no():
        if view.ActiveView is not None:
            view.sendMsgToViews("Save")
        elif not doc.InList:
            # Its file is saved; the mark stays, for closing the last view of such a document closes it.
            doc.save()
        else:
            with host.same_active_document(), _passing_view(doc):
                view.sendMsgToViews("Save")


@contextmanager
def _passing_view(doc: Any) -> Iterator[None]:
    """Keep a 3D view open during the block, without showing it."""
    window = host.main_window()
    area = window.findChild(QtWidgets.QMdiArea)
    window.setUpdatesEnabled(False)
    try:
        before, was = area.subWindowList(), area.activeSubWindow()
        host.activate(doc)
        host.run_command("Std_ViewCreate")
        made = [widget for widget in area.subWindowList() if widget not in before]
        try:
            yield
        finally:
            for widget in made:
                widget.close()
            if was is not None:
                area.setActiveSubWindow(was)
    finally:
        window.setUpdatesEnabled(True)


@contextmanager
def _answering_no() -> Iterator[None]:
    """Answer No if FreeCAD asks about the files below."""

    def answer() -> None:
        box = QtWidgets.QApplication.activeModalWidget()
        if isinstance(box, QtWidgets.QMessageBox):
            no = box.button(QtWidgets.QMessageBox.StandardButton.No)
            if no is not None:
                no.click()

    timer = QtCore.QTimer()
    timer.timeout.connect(answer)
    timer.start(0)
    try:
        yield
    finally:
        timer.stop()
