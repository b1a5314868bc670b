# SPDX-License-Identifier: LGPL-2.1-or-later
"""Yes and no in a cell, in the languages that we know, by what the column means.

A column "DNP" says *not fitted* by a word for yes, by its own title ("DNP"), and by a mark. A column
"Populate" says *fitted* so. An empty cell says what the other cells do not: fitted in a column of "DNP"; in
a column of "Populate" it is a question, unless all cells that say something say no.
"""

from __future__ import annotations

from collections.abc import Sequence

_YES_WORDS = """1; 1.0; 1.00; y; yes; true; on; x; ✓; ✔; ☑; +; ok; ja; j; wahr; an; o; oui; vrai; v; si;
    sì; sí; s;
    verdadero; vero; はい; 有; 是"""
_NO_WORDS = """0; 0.0; 0.00; n; no; false; off; -; –; —; ☐; none; n/a; nein; falsch; aus; non; faux;
    falso; いいえ; 无; 否"""
_NOT_FITTED_WORDS = """dnp; dnf; dni; dnm; nf; np; nc; excluded; exclude; unpopulated; unfitted; omit;
    omitted; no pop; no fit;
    no load; no stuff; do not populate; do not fit; do not place; do not install; do not mount;
    not fitted; not populated;
    not installed; not mounted; not placed; excluded from bom; exclude from bom; unbestückt; nicht bestückt;
    nicht bestücken; nicht montiert; entfällt"""
_FITTED_WORDS = """fitted; fit; populated; populate; installed; install; mounted; placed; place;
    included; include; bestückt;
    bestueckt; bestücken; montiert; monté; montado; montato"""
_YES, _NO, _NOT_FITTED, _FITTED = (
    frozenset(word.strip() for word in words.split(";"))
    for words in (_YES_WORDS, _NO_WORDS, _NOT_FITTED_WORDS, _FITTED_WORDS)
)


def read_yes_no(text: str) -> bool | None:
    """Read a word for yes or no; None for another word, and for none."""
    word = " ".join(text.split()).casefold().rstrip(".!")
    return True if word in _YES else False if word in _NO else None


def is_fitted(text: str, *, by_absence: bool) -> bool | None:
    """Read the cell of a column "DNP" (``by_absence``) or "Populate"; None for a word that is neither.

    An empty cell says fitted under "DNP", and nothing (None) under "Populate".
    """
    word = " ".join(text.split()).casefold().rstrip(".!")
    if not word:
        return True if by_absence else None
    if word in _NOT_FITTED:
        return False
    if word in _FITTED:
        return True
    said = read_yes_no(word)
    return None if said is None else said is not by_absence


def empty_means_fitted(cells: Sequence[str]) -> bool:
    """Return True if no cell of a column "Populate" says yes: then an empty one does not say no."""
    return not any(is_fitted(cell, by_absence=False) for cell in cells)
