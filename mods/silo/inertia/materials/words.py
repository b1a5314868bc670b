# SPDX-License-Identifier: LGPL-2.1-or-later
"""Material texts compared by whole words. "Aluminum - 6061" is aluminium; "PCB FR4" is not PC. Pure.

A material inside a longer text is judged by the words around it:

* platings and coats are left out: "zinc plated steel" is steel, and "zinc plated" alone is nothing;
* fills, percentages and compounds make something else of it: "PLA, 20 %", "bronzefill PLA", "lead free";
* colours, forms, treatments and grades say nothing about a density: "6061-T6 plate, black anodized";
* any other word makes the answer a guess: "tin can" may be tin, and may be a can.
"""

from __future__ import annotations

import re
from collections.abc import Set

from silo.bom.numbers import plain_text

Words = tuple[str, ...]

# A number keeps its point (1.4301, A356.0); percent signs and marks of doubt count; all else separates.
_WORD = re.compile(r"[^\W_]+(?:\.\d+)*|[%?~≈]")

_COMPOUNDS = {
    "foam", "foamed", "foaming", "schaum", "sponge", "honeycomb", "wabe", "porous", "expanded", "lw",
    "lightweight", "powder", "pulver", "wool", "wolle", "mesh", "oxide", "dioxide", "nitride",
    "chloride", "sulfate", "sulphate", "paint", "lacquer", "lack", "spray", "paste", "ink", "free",
    "non", "sintered", "gesintert", "infill", "füllung", "rope", "seil", "cable", "kabel", "braid",
    "braided", "like", "imitation", "replacement", "substitute", "infused", "effect", "fill", "filled",
    "filler", "gefüllt", "füllstoff", "loaded", "reinforced", "verstärkt", "renforcé", "cf", "gf", "gk",
    "percent", "prozent", "pct", "wt", "vol", "blend", "mix", "mixed", "mischung", "mélange", "hybrid",
    "matrix", "composite", "composites", "compound", "komposit", "verbund", "alloyed", "polymer",
    "polymers", "vinyl", "resin", "clad", "cladding", "lined", "liner", "core", "cored", "kern",
    "laminate", "laminated", "laminat", "sandwich", "dibond", "bonded", "impregnated", "insert",
    "inserts", "hollow", "wood", "holz", "marble", "stone", "glow", "ceramic", "crystal", "fiber",
    "fibre", "fibers", "fibres", "faser", "chips", "flakes", "dust", "whisker", "nano",
}  # fmt: skip
_COMPOUND_SHAPES = re.compile(
    r"\d*(?:ca|cf|gb|gf|gk|gl|md|mf|td)\d{1,2}|\d{1,2}(?:ca|cf|gb|gf|gk|gl)|t[1-4]0"
    r"|\w+fills?|\w+filled|\w+gefüllt|\w+verstärkt|\w+schaum"
)
# "zinc plated steel" is steel: the word before is what lies on it.
_COVERS_WITH = {
    "plated", "coated", "plating", "coating", "finish", "finished", "beschichtet", "beschichtung",
    "überzogen", "revêtu", "recubierto", "rivestito", "dipped", "sprayed",
}  # fmt: skip
# These name themselves what lies on the part.
_COVERS = {
    "galvanized", "galvanised", "galvanizing", "electroplated", "zincked", "painted", "verzinkt",
    "feuerverzinkt", "verzinkter", "verzinktes", "vernickelt", "verchromt", "brüniert", "lackiert",
    "eloxiert", "anodized", "anodised", "anodizing", "anodize", "chromated", "phosphated", "blued",
    "blackened", "passivated", "pulverbeschichtet", "pulverlackiert", "zingué", "galvanisé", "anodisé",
    "peint", "galvanizado", "anodizado", "pintado", "zincato", "anodizzato", "verniciato", "enameled",
    "enamelled", "lacquered", "varnished",
}  # fmt: skip
# What lies on parts and is no material of the table, or is another one by itself.
_COATS = {
    "powder", "chrome", "chromium", "epoxy", "paint", "enamel", "lacquer", "oxide", "pvd", "dlc", "e",
    "ptfe", "teflon", "hard", "black", "white", "zinc", "nickel", "nitride", "conversion", "chromate",
    "phosphate", "cadmium", "clear", "wax", "oil",
}  # fmt: skip
# These lie so thick on a part that they count.
_THICK = {
    "rubber", "gummi", "pvc", "plastic", "kunststoff", "silicone", "silikon", "pu", "polyurethane", "foam",
}  # fmt: skip
_WITH = {"with", "in", "by", "mit", "avec", "con"}
_FINISHES = (("black", "oxide"), ("oxide", "finish"), ("hot", "dip"), ("hot", "dipped"))

_COLOURS = {
    "black", "white", "grey", "gray", "red", "green", "blue", "yellow", "orange", "brown", "purple",
    "pink", "violet", "natural", "nature", "clear", "transparent", "translucent", "opaque", "dark",
    "light", "matte", "matt", "glossy", "gloss", "satin", "silk", "neutral", "beige", "ivory", "bright",
    "schwarz", "weiß", "weiss", "grau", "rot", "grün", "blau", "gelb", "braun", "natur", "klar",
    "transluzent", "dunkel", "hell", "noir", "blanc", "gris", "rouge", "vert", "bleu", "jaune", "negro",
    "blanco", "rojo", "verde", "azul", "amarillo", "nero", "bianco", "grigio", "rosso", "giallo", "blu",
    "naturel", "color", "colour", "coloured", "colored", "farbe", "uv",
}  # fmt: skip
_PLAIN_WORDS = {
    "generic", "standard", "general", "plain", "pure", "virgin", "solid", "bulk", "type", "typ",
    "grade", "gr", "class", "klasse", "quality", "no", "nr", "spec", "per", "to", "and", "und", "with",
    "mit", "et", "of", "the", "in", "as", "or", "for", "material", "werkstoff", "metal", "plastic",
    "plastics", "kunststoff", "polyamide", "thermoplastic", "elastomer", "astm", "en", "din", "iso",
    "aisi", "sae", "aw", "uns", "jis", "gb", "bs", "nf", "wnr", "ams", "cw", "ek", "ac", "sheet",
    "plate", "bar", "rod", "tube", "tubing", "pipe", "profile", "wire", "strip", "foil", "film",
    "block", "round", "flat", "angle", "stock", "extrusion", "extruded", "blech", "platte", "stab",
    "rohr", "profil", "draht", "rund", "flach", "welded", "seamless", "section", "billet", "coil",
    "annealed", "hardened", "tempered", "quenched", "normalized", "normalised", "rolled", "cold", "hot",
    "drawn", "forged", "cast", "casting", "molded", "moulded", "injection", "machined", "milled",
    "turned", "ground", "polished", "brushed", "honed", "printed", "print", "printing", "fdm", "fff",
    "sla", "sls", "mjf", "slm", "dmls", "3d", "filament", "geschliffen", "gebürstet", "gehärtet",
    "vergütet", "kaltgewalzt", "warmgewalzt", "gezogen", "treated", "heat", "solution", "aged",
    "stress", "relieved", "work", "half", "full", "quarter", "bearing", "structural", "mechanical",
    "engineering", "alloy", "legierung", "alliage", "unalloyed", "wrought", "austenitic", "ferritic",
    "martensitic", "duplex", "carbon", "low", "medium", "high", "mild", "tool", "spring", "strength",
    "tensile", "yield", "hrc", "hb", "hv", "min", "max", "cutting", "machining", "soft", "hard",
    "rigid", "flexible", "flex", "tough", "pro", "plus", "basic", "premium", "homopolymer", "copolymer",
    "soda", "lime", "shore", "mm", "cm", "inch", "thick", "thickness", "gauge", "ga", "od", "id", "dia",
    "jr", "qt", "ball", "ss", "cs", "sn", "pb", "ral", "rohs", "reach", "food", "safe", "fda",
    "prusament", "polymaker", "polylite", "esun", "sunlu", "bambu", "hatchbox", "fillamentum",
    "colorfabb", "ultrafuse",
}  # fmt: skip
_HARMLESS = _COLOURS | _PLAIN_WORDS

_PLASTIC = {"plastic", "plastics", "kunststoff", "thermoplastic", "elastomer", "polyamide"}
_METALLIC = {"metal", "alloy", "legierung", "alliage"}
# Materials that name a colour as well, and what makes a colour of them.
_COLOUR_METALS = {
    "gold", "silver", "silber", "bronze", "copper", "kupfer", "titanium", "titan", "carbon", "nickel",
}  # fmt: skip
_HUES = {
    "black", "white", "grey", "gray", "red", "green", "blue", "yellow", "orange", "brown", "pink", "color",
    "colour", "coloured", "colored", "farbe", "schwarz", "weiß", "weiss", "grau", "rot", "blau", "gelb",
}  # fmt: skip
_DYED = {"anodized", "anodised", "eloxiert", "painted", "lackiert", "anodisé", "anodizado"}
# Their alloys and carats are far lighter.
_PURE = {"gold", "tungsten"}


def words(text: str) -> Words:
    """The words of a material's name in plain characters, case-folded; a percent sign is one."""
    # The only symbol that is another material without its capitals.
    return tuple(_WORD.findall(plain_text(re.sub(r"\bTiN\b", "titanium nitride", text)).casefold()))


def uncovered(text: Words, known: Set[str]) -> Words:
    """Without platings: ("zinc", "plated", "steel") → ("steel",), ("zinc", "plated") → ().

    known
        words that name a material by themselves.
    """
    kept: list[str] = []
    with_what = False
    for index, word in enumerate(text):
        if with_what and word not in _THICK and (word in known or word in _COATS or word in _WITH):
            continue
        with_what = word in _COVERS_WITH and bool(_WITH & set(text[index + 1 : index + 2]))
        if word in _COVERS or (kept and (kept[-1], word) in _FINISHES):
            if word not in _COVERS:
                kept.pop()
        elif word in _COVERS_WITH:
            if kept and not with_what and kept[-1] not in _THICK and (kept[-1] in known | _COATS):
                kept.pop()
        else:
            kept.append(word)
    return tuple(kept)


def compound(rest: Words) -> str | None:
    """The word that makes a material with these other words something else; None where there is none."""
    return next((word for word in rest if _is_compound(word)), None)


def not_understood(rest: Words) -> Words:
    """The words that may make something else of a material: no colour, form, treatment or grade."""
    return tuple(
        word
        for word in rest
        if word in "?~≈" or (len(word) > 1 and word not in _HARMLESS and not re.search(r"\d", word))
    )


def contradiction(name: str, hit: Words, density: float, text: Words, rest: Words) -> str:
    """Why the words around a material deny it, in words that end a sentence; "" where they do not.

    name, hit, density
        the material [kg/m^3], and the words that it was found by.
    text, rest
        all words, and those that are not ``hit`` and no platings.
    """
    words_around = set(rest)
    for kind, wrong in ((_PLASTIC, density > 2300), (_METALLIC, density < 1700)):
        if wrong and kind & words_around:
            return f"“{min(kind & words_around)}” in it is not said of {name}"
    if len(hit) == 1 and hit[0] in _COLOUR_METALS and (_HUES & words_around or _DYED & set(text)):
        return f"“{hit[0]}” in it may be a colour"
    if name in _PURE and rest:
        return f"“{' '.join(rest)}” in it may be an alloy or another purity"
    return ""


def find(needle: Words, hay: Words) -> int | None:
    """Where ``needle`` stands in ``hay`` as a run of whole words."""
    for start in range(len(hay) - len(needle) + 1):
        if hay[start : start + len(needle)] == needle:
            return start
    return None


def _is_compound(word: str) -> bool:
    return word == "%" or word in _COMPOUNDS or _COMPOUND_SHAPES.fullmatch(word) is not None
