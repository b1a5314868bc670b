# SPDX-License-Identifier: LGPL-2.1-or-later
"""The rows of sums below a table: "Summe", "Total", "Zwischensumme". They are no parts."""

from __future__ import annotations

from collections.abc import Sequence

from silo.bom.headers import normal

_WORD_LIST = """total; totals; sum; summe; summen; gesamt; gesamtsumme; zwischensumme; endsumme;
    subtotal; sub total;
    totaal; somme; suma; somma; totale; totalt; 合計; 小計; 总计; 合计; 小计; grand total; total parts;
    total quantity;
    total mass; total weight; total price; total cost; summe total; gesamt summe; gesamtpreis;
    gesamtgewicht;
    gesamtmenge; gesamtmasse; total général; sous total; total général ht; total ht; total ttc; net total;
    overall total; summe netto; summe brutto; nettosumme; bruttosumme; übertrag; warenwert"""
_WORDS = frozenset(word.strip() for word in _WORD_LIST.split(";"))


def is_total(names: Sequence[str], cells: Sequence[str]) -> bool:
    """Return True if a row is a sum: a cell says so, and no cell that ``names`` the row's part says
    anything else.
    """
    own = [text for text in map(str.strip, names) if text]
    if any(normal(text) not in _WORDS for text in own):
        return False
    return len(own) <= 1 and any(len(cell) < 60 and normal(cell) in _WORDS for cell in cells)
