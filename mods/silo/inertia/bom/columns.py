# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which column of a BOM means what: by alias in seven languages, by the user's word, never by position.

Onshape's columns are chosen and renamed by each company and its pages are localised; other tools differ
anyhow. An alias is compared without case, accents' composition, punctuation, and a unit in brackets.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from silo.bom.errors import InputError
from silo.inertia.bom.masses import unit_factor


class Role(StrEnum):
    """What a column is used for."""

    NAME = "name"
    PART_NUMBER = "part_number"
    DESCRIPTION = "description"
    MATERIAL = "material"
    MASS = "mass"
    TOTAL_MASS = "total_mass"
    QUANTITY = "quantity"
    ITEM = "item"
    LEVEL = "level"


# en, de, fr, es, it, ja, zh; Silo's and FreeCAD's own exports among them.
_ALIASES: dict[Role, str] = {
    Role.NAME: """name; part name; component; component name; product; product name; label; title; body;
        bezeichnung; benennung; teil; teilename; bauteil; bauteilname; produkt; nom; nom de la pièce; pièce;
        composant; désignation; nombre; nombre de pieza; pieza; componente; denominación; nome; nome parte;
        nome componente; denominazione; 名前; 名称; 部品名; 品名; パーツ名; 部品; 名稱; 零件名称;
        零件; 部件名称""",
    Role.PART_NUMBER: """part number; part no; part nr; partnumber; pn; item number; article number;
        article no; sku; child part number; teilenummer; teile nr; artikelnummer; artikel nr; sachnummer;
        numéro de pièce; référence; réf; número de pieza; número de parte; referencia; código; numero parte;
        codice; codice articolo; 部品番号; 品番; 型番; 図番;
        零件编号; 零件号; 零件號; 料号; 料號; 物料编码""",
    Role.DESCRIPTION: """description; desc; child description; beschreibung; descripción; descripcion;
        descrizione; 説明; 描述; 说明; 説明文; 備考""",
    Role.MATERIAL: """material; materials; werkstoff; werkstoffe; matériau; matière; materiau; material pieza;
        materiale; 材料; 材質; 材质; 素材""",
    Role.MASS: """mass; unit mass; mass each; weight; unit weight; weight each; masse; einzelmasse; gewicht;
        einzelgewicht; stückgewicht; masse unitaire; poids; poids unitaire; masa; masa unitaria; peso;
        peso unitario; massa; massa unitaria; 質量; 重量; 单重; 質量 単体; 质量; 单件质量; 單重""",
    Role.TOTAL_MASS: """total mass; total weight; mass total; weight total; extended mass; extended weight;
        gesamtmasse; gesamtgewicht; masse totale; poids total; masa total; peso total; massa totale;
        peso totale; 总重量; 総質量; 総重量; 合計質量; 总质量; 总重; 總重""",
    Role.QUANTITY: """quantity; qty; count; pieces; pcs; menge; anzahl; stückzahl; stück; quantité; qté; nb;
        cantidad; cant; quantità; q tà; qta; quantita; 数量; 個数; 員数; 數量""",
    Role.ITEM: """item; item no; index; pos; position; find number; find no; row; line; nr; lfd nr; rang;
        repère; article; elemento; artículo; posición; ítem; posizione; voce; 項目; 番号; 项目; 项; 序号;
        編號; 序號""",
    Role.LEVEL: """level; depth; indent; ebene; stufe; niveau; nivel; livello; レベル; 階層;
        级别; 层级; 層級""",
}

_BRACKET = re.compile(r"[\(\[（【<]\s*([^)\]）】>]*)\s*[\)\]）】>]")


def normal(header: str) -> str:
    """A header without case, punctuation, bracketed unit and double spaces."""
    text = unicodedata.normalize("NFKC", header).casefold()
    text = _BRACKET.sub(" ", text)
    return " ".join(re.sub(r"[\W_]+", " ", text).split())


# Alias → role and how well it fits: "Name" beats "Component" where a file has both.
_ROLE_OF: dict[str, tuple[Role, int]] = {
    normal(alias): (role, rank)
    for role, aliases in reversed(_ALIASES.items())
    for rank, alias in enumerate(aliases.split(";"))
}


@dataclass(frozen=True, slots=True)
class Columns:
    """Where each role is (column index), and the units that the headers of the mass columns state.

    others
        columns that mean a mass or a material as well, and lost to the one that is used.
    exact
        masses are written in full (Silo's own export does so): a short one was not rounded.
    """

    at: Mapping[Role, int]
    units: Mapping[Role, str] = field(default_factory=dict)
    others: tuple[tuple[Role, int], ...] = ()
    exact: bool = False

    def cell(self, row: Sequence[str], role: Role) -> str:
        """The row's cell for a role; "" where there is no such column or the row is too short.

        An apostrophe that keeps a spreadsheet from running the cell as a formula is no part of it.
        """
        index = self.at.get(role)
        text = row[index].strip() if index is not None and index < len(row) else ""
        return text[1:] if re.match(r"'[=+\-@]", text) else text

    @property
    def usable(self) -> bool:
        """True where rows can be told apart: by name, part number or description."""
        return bool({Role.NAME, Role.PART_NUMBER, Role.DESCRIPTION} & self.at.keys())


_TOTAL_WORDS = frozenset(
    {"total", "totale", "gesamt", "summe", "sum", "extended", "ext", "row", "line", "zeile"}
)
_MASSES = (Role.MASS, Role.TOTAL_MASS)
_ONE_ONLY = (*_MASSES, Role.MATERIAL)
_SILOS_OWN = {"part number", "total quantity", "unreferenced since"}


def find_columns(header: Sequence[str], given: Mapping[str, str] | None = None) -> Columns:
    """Roles of a header line. ``given``: role → header text, from the user; it wins over every alias.

    A role found twice goes to the column whose name fits best, then to the first. Raises
    InputError for a role that does not exist.
    """
    wanted = _given_roles(given or {})
    at: dict[Role, int] = {}
    for role, text in wanted.items():
        place = next((i for i, cell in enumerate(header) if normal(cell) == normal(text)), None)
        if place is not None:
            at[role] = place
    taken = set(at.values())
    best: dict[Role, int] = {}
    seen: list[tuple[Role, int]] = []
    for index, cell in enumerate(header):
        found = _role_of(cell)
        if found is None or index in taken or found[0] in wanted:
            continue
        role, rank = found
        seen.append((role, index))
        if rank < best.get(role, len(_ROLE_OF)):
            at[role], best[role] = index, rank
    units = {role: unit for role in _MASSES if role in at and (unit := _unit_of(header[at[role]]))}
    others = tuple((role, i) for role, i in seen if role in _ONE_ONLY and at[role] != i)
    exact = {normal(cell) for cell in header} >= _SILOS_OWN
    return Columns(at, units, others, exact)


def _given_roles(given: Mapping[str, str]) -> dict[Role, str]:
    known = {role.value for role in Role}
    unknown = sorted(set(given) - known)
    if unknown:
        raise InputError(
            f"unknown column role {', '.join(unknown)}; the roles are {', '.join(sorted(known))}"
        )
    return {Role(role): text for role, text in given.items()}


def _role_of(cell: str) -> tuple[Role, int] | None:
    """Role and rank of one header cell: "Mass", "Mass (g)", "mass_kg", "Gewicht in kg"."""
    text = normal(cell)
    found = _alias(text)
    if found is not None and found[0] is Role.MASS and _says_total(cell):
        return Role.TOTAL_MASS, found[1]
    if found is None and _says_total(cell):
        # "Weight, total kg", "Summe Masse": what is left without the word is a mass or nothing.
        rest = _alias(" ".join(word for word in text.split() if word not in _TOTAL_WORDS))
        return (Role.TOTAL_MASS, rest[1]) if rest is not None and rest[0] is Role.MASS else None
    return found


def _says_total(cell: str) -> bool:
    text = unicodedata.normalize("NFKC", cell).casefold()
    return bool(_TOTAL_WORDS & set(re.findall(r"[^\W_]+", text))) or "合計" in text


def _alias(text: str) -> tuple[Role, int] | None:
    if text in _ROLE_OF:
        return _ROLE_OF[text]
    stem, _, unit = text.rpartition(" ")
    found = _ROLE_OF.get(stem.removesuffix(" in"))
    if found and found[0] in (Role.MASS, Role.TOTAL_MASS) and unit_factor(unit) is not None:
        return found
    return None


def _unit_of(cell: str) -> str | None:
    """The unit a mass column's header states, in brackets or as its last word."""
    bracket = _BRACKET.search(unicodedata.normalize("NFKC", cell))
    if bracket and unit_factor(bracket[1]) is not None:
        return bracket[1].strip()
    words = normal(cell).split()
    return words[-1] if len(words) > 1 and unit_factor(words[-1]) is not None else None
