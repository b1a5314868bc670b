# SPDX-License-Identifier: LGPL-2.1-or-later
"""Case 35: densities by whole words, never by parts of words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from silo.bom.errors import ConfigError
from silo.inertia.materials.densities import parse_density
from silo.inertia.materials.files import package_rows
from silo.inertia.materials.material import Material, MaterialHit, MaterialMiss
from silo.inertia.materials.table import MaterialTable, load_materials

# The spec's table, Task 3.
SPEC = {
    "aluminum": 2700, "aluminium": 2700, "steel": 7850, "stainless steel": 8000, "brass": 8500,
    "copper": 8960, "titanium": 4500, "abs": 1050, "pla": 1250, "petg": 1270, "nylon": 1150, "pc": 1200,
    "polycarbonate": 1200,
    "acrylic": 1180, "pmma": 1180, "hdpe": 970, "pp": 905, "pom": 1410, "delrin": 1410, "ppa-cf": 1400,
    "nylon-cf": 1200, "carbon fiber": 1600, "fiberglass": 1900, "rubber": 1100, "silicone": 1100, "tpu": 1200,
}  # fmt: skip


KNOWN = {
    20: "EPS",
    33: "Styrofoam",
    200: "cork",
    720: "Wood (Oak)",
    905: "Polypropylene",
    945: "PE",
    970: "HDPE; PE-HD; Polyethylene (HDPE)",
    1050: "ABS Plastic; ＡＢＳ; plastic ABS",
    1100: "Silicon rubber; Silicone, Shore A 40",
    1130: "PC/ABS",
    1150: "EPDM",
    1180: "Plexiglass",
    1200: "PC; pa12-cf",
    1250: "PLA+; NBR; NBR 70 Shore; Soft PVC",
    1350: "Pertinax",
    1410: "POM-C, black; Plastic, Acetal, Black",
    1510: "Ultem 2300",
    1600: "Carbon fiber black",
    1740: "Magnesium",
    1850: "FR4; PCB; PCB FR4; PCB 1.6 mm; FR4 1.6mm",
    1900: "Viton",
    2500: "Glass, Soda-Lime",
    2670: "AlMg3",
    2700: (
        "Aluminum - 6061; Aluminium 6082-T6; anodized aluminum; Powder-coated aluminum; "
        "Aluminum 6061-T6, black anodized; Al; EN-AW 6082-T6"
    ),
    2710: "ADC12",
    2780: "Duralumin",
    2810: "EN AW-7075 T651",
    3100: "silicon carbide, black",
    4430: "Ti-6Al-4V; Titanium - Grade 5; Titanium Grade 5 black anodized",
    5220: "TiN",
    7200: "Iron, Cast; GG-25",
    7290: "TIN",
    7650: "silicon steel",
    7700: "SUS440C",
    7800: "A2 tool steel",
    7810: "100Cr6",
    7850: (
        "Steel - AISI 1020; Zinc plated steel; Steel, zinc plated; Steel wire; "
        "Steel with black oxide finish; verzinkter Stahl; Zinc plated steel grade 8.8; "
        "AISI 1020 Steel, Cold Rolled; Steel, Carbon; Steel - Plain Carbon; "
        "Cold rolled steel sheet 2 mm; Steel S235 JR; Steel plated with zinc; "
        "Steel coated in nickel, painted; Metal: Steel; C 45; 4140; 8.8; carbon steel, plate; "
        "zn plated steel"
    ),
    8000: "AISI 304; Stainless Steel 316L; Edelstahl 1.4301; 不锈钢; 304; Steel 304; A2; A2-70; AISI316L",
    8500: "Messing; brass, nickel plated; Brass nickel plated",
    8730: "Nickel silver; German silver; nickel silver wire",
    8960: "Cu; Copper, silver plated; copper natural",
    11340: "Lead",
    19300: "Tungsten",
}  # fmt: skip
UNKNOWN = (
    "A; Environment coating; Scfoam; Aluminum foam; lead free solder; Nylon glass filled; PA6-GF30; "
    "PETG-CF; LW-PLA; Brass/Steel; Silver nickel; Silver paint; Sintered bronze; PLA, 20% infill; "
    "Steel wire rope; Copper cable; Titanium dioxide; Zinc plated; Nickel-plated; Titanium coated; "
    "Galvanized; Black oxide; Hard anodized; Iron-on vinyl; Tungsten polymer; Steel 50 % fill; "
    "20 % PLA; PLA 20%; PA 6 %; PLA, 20 percent; Bronzefill PLA; Copperfill; PP-T20; PA6 30GF; "
    "Copper clad aluminum; Alu-Dibond; PLA wood; Lead crystal; Glass ceramic; Steel core; "
    "Unobtainium; Default; ---; Steel coated with rubber; Rubber coated steel; PVC coated steel; "
    "Steel TiN coated; Aluminium, gold anodized; PEEK 450CA30; PA12 30GL; coated with steel; "
    "plated in gold"
)
DOUBTED = (
    "Gold anodized; silver painted; Titanium white; Carbon black; Nickel grey; gold colour; "
    "metal PLA; PLA - metal; Steel with plastic; plastic coated steel; Gold 18k; Tungsten alloy; "
    "Steel?; ~Steel; Steel (?); ≈ brass; Stahl geh?rtet"
)
MIXED = "Al foam; PE foam; NBR/steel; cork-rubber; Al/PE; PLA with 20 % cork"


def texts(listed: str) -> Any:
    """A parameter for each text of a list."""
    return pytest.mark.parametrize("text", listed.split("; "))


@pytest.mark.parametrize(
    ("text", "density"),
    [*SPEC.items(), *((text, density) for density, listed in KNOWN.items() for text in listed.split("; "))],
)
def test_texts_that_name_a_material(materials: MaterialTable, text: str, density: float) -> None:
    """The spec's materials, alloys, numbers of standards, other languages, platings, everyday words."""
    hit = materials.find(text)
    assert isinstance(hit, MaterialHit), hit
    assert (hit.material.density, hit.doubt) == (density, "")
    assert hit.material.source


@texts(UNKNOWN)
def test_texts_that_only_look_like_one(materials: MaterialTable, text: str) -> None:
    """A part of a word, a filled, foamed or coated material, two at once: no guess, and a reason."""
    miss = materials.find(text)
    assert isinstance(miss, MaterialMiss), miss
    assert miss.reason


@texts(MIXED)
def test_short_words_do_not_make_a_material_of_a_mixture(materials: MaterialTable, text: str) -> None:
    """A mixture stays unknown, or in doubt."""
    found = materials.find(text)
    assert not isinstance(found, MaterialHit) or found.doubt


@texts(DOUBTED)
def test_words_that_deny_a_material_leave_a_doubt(materials: MaterialTable, text: str) -> None:
    """A colour, a class of other materials, an alloy of a pure one, a question mark."""
    found = materials.find(text)
    assert isinstance(found, MaterialHit)
    assert found.doubt


@pytest.mark.parametrize(
    ("text", "density"),
    [("Tin can", 7290), ("Glass bead", 2500), ("Iron pipe fitting", 7870), ("ACME PLA", 1250)],
)
def test_texts_with_a_word_that_is_not_understood(
    materials: MaterialTable, text: str, density: float
) -> None:
    """Used, and said: an unknown word may make another material of it."""
    hit = materials.find(text)
    assert isinstance(hit, MaterialHit)
    assert (hit.material.density, bool(hit.doubt)) == (density, True)


@pytest.mark.parametrize(
    ("text", "nearest"),
    [("20 % PLA", "pla"), ("Zinc plated", "steel"), ("Iron-on vinyl", "iron"), ("Aluminim 6061", None),
     ("Alumnium", "aluminum"), ("6062 aluminum fill", "aluminum"), ("Unobtainium", None)],
)  # fmt: skip
def test_the_nearest_guess_is_named(materials: MaterialTable, text: str, nearest: str | None) -> None:
    """For a person to decide; it decides nothing by itself."""
    answer = materials.find(text)
    if isinstance(answer, MaterialMiss):
        assert (answer.nearest.name if answer.nearest else None) == nearest
        assert nearest is None or nearest in answer.advice
    else:
        assert (nearest, bool(answer.doubt)) == (None, True)


def test_a_users_row_is_no_reason_to_overlook_a_better_one(materials: MaterialTable) -> None:
    """With "steel" in the user's table, "stainless steel 316, brushed" is still stainless."""
    table = MaterialTable(((Material("steel", 7700),), *materials.layers), materials.cards)
    for text, density in (("Stainless steel 316, brushed", 8000), ("Steel, brushed", 7700), ("steel", 7700)):
        hit = table.find(text)
        assert isinstance(hit, MaterialHit)
        assert hit.material.density == density


def test_rows_of_the_package_are_sound() -> None:
    """Names are unique, densities are those of solids, sources are named, families exist."""
    rows = package_rows()
    names = [row.name for row in rows]
    assert len(set(names)) == len(names)
    assert all(15 < row.density < 23_000 for row in rows)
    assert all(row.source for row in rows)
    assert {row.family for row in rows if row.family} <= set(names)


def test_no_alias_names_two_densities() -> None:
    """An alias of two rows would decide by the order of a file."""
    from silo.inertia.materials.words import words

    seen: dict[tuple[str, ...], Material] = {}
    for row in package_rows():
        for alias in (row.name, *row.aliases):
            other = seen.setdefault(words(alias), row)
            assert other is row, f"“{alias}” is {row.name} and {other.name}"
    joined: dict[str, Material] = {}
    for key, row in seen.items():
        other = joined.setdefault("".join(key), row)
        assert other.density == row.density, f"{key} is {row.name} and {other.name} when written as one word"


def test_user_table_wins(tmp_path: Path) -> None:
    """CSV with a density unit in the header, TOML in both forms; the last file wins over the first."""
    csv = tmp_path / "ours.csv"
    csv.write_text("name,density (g/cm3),aliases\nsteel,7.7,\nour alloy,2.81,OA 5; oa-five\n", "utf-8")
    toml = tmp_path / "ours.toml"
    toml.write_text(
        '[materials]\n"foam core" = 60\nsteel = "7.6 g/cm3"\n'
        'resin = { density = 1150, aliases = ["tough 2000"] }\n',
        "utf-8",
    )
    table = load_materials([csv, toml], freecad=False)

    def density(text: str) -> float:
        hit = table.find(text)
        assert isinstance(hit, MaterialHit)
        return hit.material.density

    assert density("steel") == pytest.approx(7600)
    assert density("OA-5") == pytest.approx(2810)
    assert density("Foam core") == 60
    assert density("Tough 2000 (grey)") == 1150
    assert density("brass") == 8500


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.csv", "material,rho\nsteel,7850\n", "wanted columns “name” and “density”"),
        ("a.csv", "name,density\nsteel,heavy\nlead,-3\n", "line 2.*line 3"),
        ("a.csv", "name,density (stone)\nsteel,1\n", "unknown density unit"),
        ("a.csv", "name,density\nsteel,7.85\n", "line 2: “steel” has the density 7.85 without a unit"),
        ("a.toml", "[materials]\nalu = 2.7\n", "materials.alu: .*“2.7 g/cm3” or “2.7 kg/m3”"),
        ("a.csv", "name,density\nsteel,7850\nSteel,7700\n", "“Steel” has two densities, 7850 and 7700"),
        ("a.csv", "name,density,aliases\nx,900,blend\ny,950,Blend\n", "“Blend” has two densities"),
        ("a.toml", "materials = 3\n", r"\[materials\]"),
        ("a.toml", "[materials\n", "not valid TOML"),
        ("a.xls", "", r"\.csv or \.toml"),
    ],
)
def test_bad_user_tables_are_plain_errors(tmp_path: Path, name: str, text: str, words: str) -> None:
    """All bad rows at once, with their lines."""
    path = tmp_path / name
    path.write_text(text, "utf-8")
    with pytest.raises(ConfigError, match=words):
        load_materials([path], freecad=False)


def test_light_materials_and_other_separators(tmp_path: Path) -> None:
    """A foam with its unit, in a cell or in the header; a table as German spreadsheets write it."""
    foam = tmp_path / "foam.csv"
    foam.write_text("name;density (kg/m3)\nEPS;15\nhouse blend;1250,5\n", "utf-8")
    one = tmp_path / "one.csv"
    one.write_text("name,density\nEPS,15 kg/m3\n", "utf-8")
    for path in (foam, one):
        hit = load_materials([path], freecad=False).find("EPS")
        assert isinstance(hit, MaterialHit)
        assert hit.material.density == 15


def test_a_missing_user_table_is_a_plain_error(tmp_path: Path) -> None:
    """With its path."""
    with pytest.raises(ConfigError, match=r"none\.csv"):
        load_materials([tmp_path / "none.csv"])


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("7900 kg/m^3", 7900),
        ("1200,00 kg/m^3", 1200),
        ("1.204 kg/m^3", None),  # air
        ("7,850 kg/m^3", None),
        ("1,19 g/cm³", 1190),
        ("0.2852 lb/in3", 7894.308823),
        ("7850", 7850),
        ("7.85 t/m3", 7850),
        ("x,000 kg/m^3", None),
        ("0 kg/m^3", None),
        ("-3", None),
        ("7 stones/barrel", None),
    ],
)
def test_densities(text: str, value: float | None) -> None:
    """Units of cards and of people; what cannot be read is None."""
    assert parse_density(text) == (pytest.approx(value, rel=1e-5) if value is not None else None)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.csv", 'name,density\nour steel,"7,850 kg/m3"\n'),
        ("a.csv", "name;density\nour steel;7.850 kg/m3\n"),
        ("a.csv", 'name,density (kg/m3)\nour steel,"7,850"\n'),
        ("a.csv", 'name,density\nour steel,"7,850"\n'),
        ("a.toml", '[materials]\n"our steel" = "7,850 kg/m3"\n'),
    ],
)
def test_a_density_with_two_readings_is_refused_with_both(tmp_path: Path, name: str, text: str) -> None:
    """“7,850 kg/m3” became 7.85 kg/m³, a thousand times too little, without a word."""
    path = tmp_path / name
    path.write_text(text, "utf-8")
    with pytest.raises(ConfigError, match=r"7850 or 7\.85; write"):
        load_materials([path], freecad=False)


@pytest.mark.parametrize(
    "text", ["7,850 g/cm3", "7.850 g/cm³", "7,850 t/m^3", "7 850 kg/m³", "7_850", "7.85e3"]
)
def test_a_density_that_nature_decides(tmp_path: Path, text: str) -> None:
    """7850 g/cm³ is denser than any metal, so that one reading is left; spaces leave only one anyway."""
    path = tmp_path / "a.csv"
    path.write_text(f'name,density\nour steel,"{text}"\n', "utf-8")
    hit = load_materials([path], freecad=False).find("our steel")
    assert isinstance(hit, MaterialHit)
    assert hit.material.density == pytest.approx(7850)


@pytest.mark.parametrize(
    ("density", "words"),
    [
        ("7850 g/cm3", "denser than any metal"),
        ("78500", "denser than any metal"),
        ("1.2 kg/m3", "lighter than any solid"),
        ("0.0027 g/cm3", "lighter than any solid"),
        ("0 kg/m3", "lighter than any solid"),
        ("-7850", "lighter than any solid"),
        ("1e400", "denser than any metal"),
        ("5² g/cm3", "wanted a number"),
    ],
)
def test_a_density_that_nothing_has(tmp_path: Path, density: str, words: str) -> None:
    """The plausibility check of masses holds for the tables as well."""
    path = tmp_path / "a.csv"
    path.write_text(f"name,density\nour steel,{density}\n", "utf-8")
    with pytest.raises(ConfigError, match=words):
        load_materials([path], freecad=False)


def test_cards_come_last(materials: Any) -> None:
    """A FreeCAD card fills a gap of the table and never overrides it; only its whole name counts."""
    cards = (Material("Steel", 7777), Material("Reinforcement-Harry", 7850), Material("Wood", 700))
    table = MaterialTable(materials.layers, lambda: cards)
    steel, harry = table.find("Steel"), table.find("reinforcement harry")
    assert isinstance(steel, MaterialHit)
    assert isinstance(harry, MaterialHit)
    assert steel.material.density == 7850
    assert harry.material is cards[1]
    assert isinstance(table.find("Wood screw thing"), MaterialMiss)


def test_an_installed_freecad_changes_no_result_without_a_word(materials: MaterialTable) -> None:
    """A card with the whole name beats a guess, and says so; what the table knows stays as it is."""
    cards = (Material("Aluminum 6061-T6", 2600), Material("ACME PLA", 1333), Material("PLA wood", 1150))
    with_cards = MaterialTable(materials.layers, lambda: cards)
    known = with_cards.find("Aluminum 6061-T6")
    assert known == materials.find("Aluminum 6061-T6")
    guess = with_cards.find("ACME PLA")
    assert isinstance(guess, MaterialHit)
    assert guess.material.density == 1333
    assert "1250" in guess.doubt
    assert "FreeCAD card" in guess.doubt
    gap = with_cards.find("PLA wood")
    assert isinstance(gap, MaterialHit)
    assert gap.material is cards[2]


@pytest.mark.parametrize("text", ["Air", "FEB", "Pb", "XY", "30 4", "1 7 4"])
def test_short_texts_are_like_nothing(materials: MaterialTable, text: str) -> None:
    """Three letters are near to any three others; "Air" is no "acier"."""
    found = materials.find(text)
    assert isinstance(found, MaterialMiss)
    assert found.nearest is None


@pytest.mark.parametrize(
    ("header", "density"),
    [
        ("density lb/ft3", 7.85 * 0.45359237 / 0.3048**3),
        ("Density_g/cm3", 7850),
        ("density [g/cm³]", 7850),
        ("density, t/m3", 7850),
    ],
)
def test_a_unit_in_a_header_needs_no_brackets(tmp_path: Path, header: str, density: float) -> None:
    """Read as kg/m³, "density lb/ft3" would be 16 times too light for every row."""
    from silo.inertia.materials.files import user_rows

    (tmp_path / "m.csv").write_text(f'name,"{header}"\nx,7.85\n')
    assert user_rows(tmp_path / "m.csv")[0].density == pytest.approx(density)


def test_a_users_table_may_say_how_much_a_density_varies(tmp_path: Path) -> None:
    """In percent, in both formats; what is no percentage is refused."""
    from silo.inertia.materials.files import user_rows

    (tmp_path / "m.csv").write_text("name,density,spread\nx,500 kg/m3,20\ny,500 kg/m3,5 %\nz,500 kg/m3,\n")
    assert [row.spread for row in user_rows(tmp_path / "m.csv")] == [0.2, 0.05, 0.0]
    (tmp_path / "m.toml").write_text('[materials]\nx = { density = 500, spread = 20, aliases = ["a"] }\n')
    (row,) = user_rows(tmp_path / "m.toml")
    assert (row.spread, row.aliases) == (0.2, ("a",))
    (tmp_path / "m.csv").write_text("name,density,spread\nx,500 kg/m3,much\ny,500 kg/m3,120\n")
    with pytest.raises(ConfigError, match=r"“x”.*“much”.*“y”.*“120”"):
        user_rows(tmp_path / "m.csv")


def test_columns_beside_the_wanted_ones_are_none_of_them(tmp_path: Path) -> None:
    """Where a table has more than we ask for, "name" is the name, and "density" the density."""
    from silo.inertia.materials.files import user_rows

    (tmp_path / "m.csv").write_text("name,name_de,density,density_source\nx,y,500 kg/m3,me\n")
    assert [(row.name, row.density) for row in user_rows(tmp_path / "m.csv")] == [("x", 500)]
    (tmp_path / "m.toml").write_text('[materials]\nx = { density = 500, name = "y" }\n')
    assert [row.name for row in user_rows(tmp_path / "m.toml")] == ["x"]
    (tmp_path / "m.toml").write_text("[materials]\nx = { density = 500, aliases = 5 }\n")
    with pytest.raises(ConfigError, match=r"aliases of “x”.*“5”"):
        user_rows(tmp_path / "m.toml")


def test_a_card_with_the_density_of_a_guess_settles_it() -> None:
    """A card of that name is no other material than the guess if both weigh the same."""
    guess = MaterialTable((package_rows(),)).find("tin can")
    assert isinstance(guess, MaterialHit)
    assert guess.doubt
    card = Material("tin can", guess.material.density)
    assert MaterialTable((package_rows(),), lambda: [card]).find("tin can") == MaterialHit(card)


@pytest.mark.parametrize(
    ("text", "density"),
    [
        ("Gray iron", 7150), ("Iron, Gray", 7150), ("grey iron", 7150), ("Gray cast iron", 7200),
        ("White iron", 7700), ("Red brass", 8750), ("Brass, red", 8750),
        ("Gray steel", 7850), ("gray aluminum", 2700),
    ],
)  # fmt: skip
def test_a_colour_is_part_of_a_metal_s_name_where_a_metal_has_it(text: str, density: float) -> None:
    answer = load_materials(freecad=False).find(text)
    assert isinstance(answer, MaterialHit)
    assert answer.material.density == density
