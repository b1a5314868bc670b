# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a column of a BOM means, by its header: one table for the BOM parser and the server's import.

Columns are chosen and renamed by each company, and CAD systems are localised. An alias is compared without
case, punctuation, and a unit in brackets; a position never decides. Pure.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Any

from silo.bom.message import joined, message

# What Excel, LibreOffice and Google Sheets take for the beginning of a formula (OWASP, CSV injection).
FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")


class Heading(StrEnum):
    """What a column is used for."""

    NAME = "name"
    PART_NUMBER = "part_number"
    DESCRIPTION = "description"
    MATERIAL = "material"
    MASS = "mass"
    TOTAL_MASS = "total_mass"
    MASS_UNIT = "mass_unit"
    QUANTITY = "quantity"
    ITEM = "item"
    LEVEL = "level"
    UNIT = "unit"
    REFERENCE_DESIGNATORS = "reference_designators"
    FIND_NUMBER = "find_number"
    NOTES = "notes"
    TYPE = "rel_type"
    REVISION = "child_revision"
    VALUE = "value"
    FOOTPRINT = "footprint"
    MANUFACTURER = "manufacturer"
    MANUFACTURER_NUMBER = "manufacturer_part_number"
    SUPPLIER = "supplier"
    SUPPLIER_NUMBER = "supplier_part_number"
    NOT_FITTED = "not_fitted"
    FITTED = "fitted"
    LINK = "link"
    PACK_SIZE = "pack_size"
    MINIMUM = "minimum"
    PRICE = "prices"
    PRICE_BASIS = "price_basis"
    FROM_QUANTITY = "from"
    CURRENCY = "currency"
    LEAD_TIME = "lead_time_days"
    PREFERRED = "preferred"
    CATEGORY = "category"
    ITEM_TYPE = "item_type"
    SOURCING = "sourcing_type"
    ASSEMBLY = "is_assembly"
    ATTACHMENTS = "attachments"


# en, de, fr, es, it, ja, zh; Silo's and FreeCAD's own exports among them. The first alias fits best.
_ALIASES: dict[Heading, str] = {
    Heading.NAME: """name; part name; component; component name; product; product name; label; title; body;
        bezeichnung; benennung; teil; teilename; bauteil; bauteilname; produkt; nom; nom de la pièce; pièce;
        composant; désignation; nombre; nombre de pieza; pieza; componente; denominación; nome; nome parte;
        nome componente; denominazione; 名前; 名称; 部品名; 品名; パーツ名; 部品; 名稱; 零件名称;
        零件; 部件名称; 이름; item name;
        objektkurztext; materialkurztext; designation; piece; denominacion; part""",
    Heading.PART_NUMBER: """part number; ipn; part ipn; internal part number; internal reference;
        part no; part nr;
        partnumber; pn; item number; article number; article no; child part number; our part number;
        our number; unsere artikelnummer; interne artikelnummer; interne teilenummer; materialnummer;
        teilenummer; teile nr; artikelnummer; artikel nr; sachnummer;
        numéro de pièce; référence; réf; número de pieza; número de parte; referencia; código; numero parte;
        codice; codice articolo; 部品番号; 品番; 型番; 図番;
        零件编号; 零件号; 零件號; 料号; 料號; 物料编码; number; item id;
        bauteilnummer; komponentennummer; n de pièce; n o de pièce; numero de piece; n de pieza;
        n o de pieza;
        numero de pieza; numero de parte; codigo; 부품 번호""",
    Heading.DESCRIPTION: """description; desc; child description; beschreibung; descripción; descripcion;
        descrizione; 説明; 描述; 说明; 説明文; 備考""",
    Heading.MATERIAL: """material; materials; werkstoff; werkstoffe; matériau; matière; materiau;
        material pieza; materiale; 材料; 材質; 材质; 素材; 재질; 재료; matl;
        mat l; mtl; ptc material name; nx material""",
    Heading.MASS: """mass; unit mass; mass each; weight; unit weight; weight each; masse; einzelmasse;
        gewicht; einzelgewicht; stückgewicht; masse unitaire; poids; poids unitaire; masa; masa unitaria;
        peso; peso unitario; massa; massa unitaria; 質量; 重量; 单重; 質量 単体; 质量; 单件质量; 單重; gew;
        einzelgew; nettogewicht; pds; 単重; 単体質量; 単体重量; 净重; 单件重量; 질량; 무게;
        wt; unit wt; nx mass; sw mass; pro mp mass; mp mass""",
    Heading.TOTAL_MASS: """total mass; total weight; mass total; weight total; extended mass;
        extended weight;
        gesamtmasse; gesamtgewicht; masse totale; poids total; masa total; peso total; massa totale;
        peso totale; 总重量; 総質量; 総重量; 合計質量; 总质量; 总重; 總重; 合计重量;
        小计重量; 質量計; 重量計; total wt; ext wt; posgewicht; pos gewicht; positionsgewicht""",
    Heading.MASS_UNIT: """mass unit; mass units; weight unit; weight units; unit of mass; unit of weight;
        mass uom; weight uom; gewichtseinheit; masseneinheit; unité de masse; unidad de masa""",
    Heading.QUANTITY: """quantity; qty; qnty; count; pieces; pcs; menge; anzahl; stückzahl; stück; quantité;
        qté; nb; cantidad; cant; quantità; q tà; qta; quantita; 数量; 個数; 員数; 數量; 수량; qte; qtà;
        quantite; anz; komponentenmenge; req qty; qty reqd; qty req d; no req d""",
    Heading.ITEM: """item; item no; index; pos; position; row; line; nr; lfd nr; rang;
        repère; article; elemento; artículo; posición; ítem; posizione; voce; 項目; 番号; 项目; 项; 序号;
        編號; 序號; 项目号; アイテム番号; 항목; 항목 번호; pos nr; positionsnummer; objekt; element; élément;
        no article; n articolo; n de elemento; n o de elemento; articulo; posicion""",
    Heading.LEVEL: """level; bom level; structure level; depth; indent; indentation; ebene; stufe;
        strukturstufe;
        stücklistenebene; niveau; nivel; livello; レベル; 階層;
        级别; 层级; 層級""",
    Heading.UNIT: """unit; units; uom; unit of measure; einheit; einheiten; mengeneinheit; me; bme;
        basismengeneinheit; unité; unités; unidad; unidades; unità; 単位; 单位""",
    Heading.REFERENCE_DESIGNATORS: """reference designators; reference designator; ref des; refdes;
        designators; designator; references; reference; reference s; ref; refs; ref s""",
    Heading.FIND_NUMBER: """find number; find no; find nr; findnumber""",
    Heading.NOTES: """notes; note; remarks; remark; comment; comments; bemerkung; bemerkungen; notiz;
        remarque; remarques; notas; 注記; 备注; 備註""",
    Heading.TYPE: """type; rel type; relation type""",
    Heading.REVISION: """revision""",
    Heading.VALUE: """value; val; wert; valeur; valor; valore""",
    Heading.FOOTPRINT: """footprint; package; case package; gehäuse; boîtier""",
    Heading.MANUFACTURER: """manufacturer; mfr; mfg; mfr name; manufacturer name; hersteller; fabricant;
        fabricante; produttore; maker""",
    Heading.MANUFACTURER_NUMBER: """manufacturer part number; manufacturer s part number; mpn;
        mfr part number; mfr part no; mfr pn; mfg pn; mfg part number; mfr no; manufacturer part no;
        manufacturer pn; herstellernummer; hersteller teilenummer; herstellerteilenummer;
        hersteller artikelnummer""",
    Heading.SUPPLIER: """supplier; vendor; distributor; supplier name; vendor name; lieferant; händler;
        fournisseur; proveedor; fornitore; 供应商; 仕入先""",
    Heading.SUPPLIER_NUMBER: """supplier part number; supplier s part number; spn; sku; supplier sku;
        vendor sku; supplier part no;
        vendor product code; artikelnummer lieferant; lieferanten artikelnummer;
        artikelnummer des lieferanten;
        supplier pn; vendor part number; distributor part number; bestellnummer; order number; order code;
        lcsc; supplier number; supplier no; order no; vendor number; bestell nr; lieferantenartikelnummer;
        lieferantennummer; référence fournisseur; numéro de commande;
        lcsc part number; digikey part number; digi key part number; mouser part number""",
    Heading.NOT_FITTED: """dnp; dnf; dni; nf; do not populate; do not fit; do not place; do not install;
        not fitted;
        not populated; not installed; excluded; exclude; exclude from bom; excluded from bom;
        nicht bestückt;
        nicht bestücken; unbestückt; non monté; no montar; non montare""",
    Heading.FITTED: """populate; populated; fitted; fit; installed; install; mounted; place; placed;
        included;
        include; bestückt; bestücken; montiert; monté; montado; montato""",
    Heading.LINK: """link; url; web address; web; product link; shop link""",
    Heading.PACK_SIZE: """pack size; pack; pack quantity; package size; packaging unit; pack qty; vpe;
        verpackungseinheit; packungsgröße; conditionnement""",
    Heading.MINIMUM: """minimum; minimum order; minimum order quantity; minimum quantity; min order;
        min qty;
        moq; mindestmenge; mindestbestellmenge; quantité minimale""",
    Heading.PRICE: """price; unit price; price each; price of one by quantity; price of one; prices;
        unit cost; price list; preis; preise; stückpreis; einzelpreis; nettopreis; einkaufspreis;
        ek preis; prix; prix unitaire; precio; prezzo; 单价; 単価""",
    Heading.PRICE_BASIS: """price basis; price unit; pricing unit; price unit quantity; price per; per;
        preiseinheit; preis pro; preisbasis; pe; unité de prix; prix par; unidad de precio""",
    Heading.FROM_QUANTITY: """from quantity; from; price from quantity; break; price break; break quantity;
        scale quantity; ab menge; staffelmenge; ab stückzahl; à partir de""",
    Heading.CURRENCY: """currency; währung; devise; moneda; valuta; 货币; 通貨""",
    Heading.LEAD_TIME: """lead time; lead time days; delivery time; lieferzeit; lieferzeit tage; délai;
        délai de livraison; plazo de entrega""",
    Heading.PREFERRED: """preferred; favourite; default; bevorzugt; préféré""",
    Heading.CATEGORY: """category; part category; product category; kategorie; warengruppe; materialgruppe;
        artikelgruppe; catégorie; categoría; categoria""",
    Heading.ITEM_TYPE: """item type; part type; artikeltyp; materialart; teileart""",
    Heading.SOURCING: """sourcing; sourcing type; procurement; make or buy; make buy; beschaffung;
        beschaffungsart; purchaseable; purchasable; bought""",
    Heading.ATTACHMENTS: """attachments; attachment; attached files; anhänge; dateien""",
    Heading.ASSEMBLY: """assembly; is assembly; baugruppe; ist baugruppe""",
}

_LONGEST = 500  # characters: what follows is no heading

BRACKET = re.compile(r"[\(\[（【<]([^(\[（【<)\]）】>]*+)[\)\]）】>]")
"""A remark in brackets, a unit more often than not: its first group is what stands inside, with spaces."""


def normal(header: str) -> str:
    """Return a header in lower case, without punctuation, text in brackets and double spaces."""
    text = unicodedata.normalize("NFKC", header[:_LONGEST]).casefold()
    text = BRACKET.sub(" ", text)
    return " ".join(re.sub(r"[\W_]+", " ", text).split())


_ROLE_OF: dict[str, tuple[Heading, int]] = {
    normal(alias): (role, rank)
    for role, aliases in reversed(_ALIASES.items())
    for rank, alias in enumerate(aliases.split(";"))
}


def alias(text: str) -> tuple[Heading, int] | None:
    """Return the role of a :func:`normal` header, and how well it fits: 0 is best ("Name" beats
    "Component").
    """
    return _ROLE_OF.get(text)


def missing_columns(header: Sequence[str], at: Mapping[Heading, int], needed: Sequence[Heading]) -> str:
    """Say which of the ``needed`` columns a header lacks, and which it has; "" if it lacks none."""
    lacking = [role for role in needed if role not in at]
    if not lacking:
        return ""
    names = joined(message(" and "), (f"'{_title(role)}'" for role in lacking))
    seen = ", ".join(cell.strip() for cell in header if cell.strip())
    others = [
        message("'{title}' may also be called {others}", title=_title(role), others=_others(role))
        for role in lacking
    ]
    return message(
        "there is no column {names}; the columns are {seen}. {others}",
        names=names,
        seen=seen,
        others=joined("; ", others),
    )


def _title(role: Heading) -> str:
    return role.replace("_", " ").capitalize()


def _others(role: Heading) -> str:
    return ", ".join(name.strip() for name in _ALIASES[role].split(";")[1:5])


def designators(cell: str) -> tuple[str, ...]:
    """Split ``R1, R2 R3`` into three reference designators."""
    return tuple(cell.replace(",", " ").split())


def safe_cell(value: Any) -> Any:
    """Return a cell for CSV: a text that a program would run as a formula gets a mark; numbers stay
    numbers.
    """
    if isinstance(value, str) and value.lstrip("'").startswith(FORMULA_STARTS):
        return "'" + value
    return value


def plain_cell(text: str) -> str:
    """Return the text from which :func:`safe_cell` made a cell."""
    made_text = text.startswith("'") and text.lstrip("'").startswith(FORMULA_STARTS)
    return text[1:] if made_text else text
