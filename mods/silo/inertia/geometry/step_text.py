# SPDX-License-Identifier: LGPL-2.1-or-later
"""The text of a STEP file before the geometry kernel sees it: what is refused, what is rewritten.

Nothing here needs the kernel, so another process can do it while the kernel loads.

Flat assemblies of thousands are cut into groups. The kernel's reader goes through all uses of a product for
each of its uses: 10 000 parts on one level (a populated circuit board, a flat export) cost it 8 s, in a
hundred groups of a hundred 1 s. So the text of such a file gets groups, sub-assemblies at the origin that
:mod:`read` takes out again. Nothing else is touched; a file whose structure is not plain is left as it is.
"""

from __future__ import annotations

import mmap
import os
import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path

from silo.bom.errors import DocumentError, InputError
from silo.bom.message import message
from silo.inertia.geometry.helpers import WORTH_HELP, Helpers
from silo.inertia.geometry.options import ReadOptions
from silo.inertia.geometry.part21 import (
    HIDING,
    WANTED,
    Buffer,
    Part21,
    Products,
    count_placed,
    decoded,
    entities,
    read_products,
    ref,
    refs,
    scan,
)
from silo.inertia.geometry.part_files import file_key, step_files
from silo.inertia.notes import GeometryCode, Note

MANY_FACES = 3000
"""From so many on, measuring takes so long that a second processor is worth its start."""

_FACE = re.compile(rb"ADVANCED_FACE")
_EXTERNAL = re.compile(
    rb"((?:DOCUMENT_FILE|APPLIED_EXTERNAL_IDENTIFICATION_ASSIGNMENT|EXTERNALLY_DEFINED\w*)\s*\(\s*)'(?:[^']|'')*'"
)


@dataclass(frozen=True)
class Prepared:
    """What the text says of products, which file the kernel shall read, how many faces there are, and what
    was noticed of the names.
    """

    products: Products
    source: Path
    faces: int
    said: tuple[Note, ...] = ()


def begin(path: Path, options: ReadOptions, helpers: Helpers) -> Callable[[], Prepared]:
    """Look through a STEP file before the kernel is loaded here; a helper does that for a large file
    meanwhile.

    If the file is worth helpers, they then load the kernel, too. DocumentError is raised now, or when the
    result is asked for.
    """
    large = path.stat().st_size >= WORTH_HELP and helpers.start()
    text = helpers.begin(
        prepare, path.resolve(), helpers.folder(), options.max_instances, options.step_encoding
    )

    def found() -> Prepared:
        prepared = text()
        beside = _bytes_beside(path, prepared.products, options)
        if beside >= WORTH_HELP:
            helpers.start()
        if beside >= WORTH_HELP or prepared.faces >= MANY_FACES:
            helpers.load_kernel()
        else:
            helpers.end()
        return prepared

    if large:
        return found
    prepared = found()
    return lambda: prepared


def _bytes_beside(path: Path, products: Products, options: ReadOptions) -> int:
    """Estimate how much geometry is in the files of a split assembly; :mod:`siblings` looks closer."""
    wanted = {file_key(name) for name in products.elsewhere()} if options.siblings else None
    if not wanted:
        return 0
    folder = Path(os.path.realpath(path)).parent
    files = (file for file in step_files(folder, options.sibling_depth) if file_key(file.stem) in wanted)
    return sum(file.stat().st_size for file in islice(files, options.max_siblings))


def prepare(path: Path, folder: Path, max_instances: int, encoding: str | None = None) -> Prepared:
    """Look through a STEP file; if it is rewritten, the copy is in ``folder``. Raises DocumentError.

    encoding
        of strings that are no UTF-8; None takes Windows-1252, and notes it.
    """
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as stored:
        recoded, foreign = in_utf8(stored, encoding or USUAL_ENCODING)
        data: Buffer = stored if recoded is None else recoded
        text = scan(data, WANTED | HIDING if data.find(b"INVISIBILITY") > 0 else WANTED)
        if not text.complete:
            raise DocumentError(
                str(path),
                message("the file ends in the middle (no END-ISO-10303-21); export or copy it again"),
            )
        products = read_products(text)
        _refuse_bombs(path, products, max_instances)
        changed, added = regrouped(text, products)
        products = replace(products, count=products.count + added)
        if text.ids.get("DOCUMENT_FILE"):
            # The kernel would open the files that are named, in any folder, without asking.
            changed = _EXTERNAL.sub(rb"\1'silo-looks-for-it'", data[:] if changed is None else changed)
        faces = sum(1 for _ in _FACE.finditer(data))
        said = tuple(_guessed_names(text, foreign)) if foreign and encoding is None else ()
        changed = changed or recoded
    if changed is None:
        return Prepared(products, path, faces, said)
    source = folder / "part.step"
    source.write_bytes(changed)
    return Prepared(products, source, faces, said)


USUAL_ENCODING = "cp1252"
"""Of strings that are no UTF-8, if the user names no encoding."""

_FOREIGN = re.compile(rb"'[^'\x80-\xff]*+[\x80-\xff][^']*+'")
"""A string with bytes above 127. Outside of strings and comments no file has such bytes."""

_NAMED = ("PRODUCT", "NEXT_ASSEMBLY_USAGE_OCCURRENCE", "DESCRIPTIVE_REPRESENTATION_ITEM", "DOCUMENT_FILE")


def in_utf8(data: Buffer, encoding: str) -> tuple[bytes | None, frozenset[str]]:
    """Write a file's strings in UTF-8, each that is not in it already. Returns the text and these strings;
    (None, none) if all is UTF-8.

    The standard knows ASCII with escapes only. What programs write anyway is the code page of its
    machine, and Shift-JIS and GBK have bytes in it that look like the backslash of an escape.
    """
    foreign: set[str] = set()

    def recoded(match: re.Match[bytes]) -> bytes:
        try:
            match[0].decode("utf-8")
        except UnicodeDecodeError:
            # Old programs break lines after 72 bytes, in the middle of a character too.
            whole = match[0].translate(None, b"\r\n").decode(encoding, errors="replace").encode("utf-8")
            foreign.add(decoded(whole[1:-1]))
            return whole
        return match[0]

    if _FOREIGN.search(data) is None:
        return None, frozenset()
    new = _FOREIGN.sub(recoded, data)
    return (new if foreign else None), frozenset(foreign)


def _guessed_names(text: Part21, foreign: frozenset[str]) -> Iterator[Note]:
    """Note that names of the file are in an encoding that was guessed."""
    found = (value for _, arguments in text.of(*_NAMED) for value in arguments if value in foreign)
    names = list(islice(dict.fromkeys(found), 3))
    if names:
        words = message(
            "names in the file are no UTF-8 and were read as Windows-1252: {names}; if that is wrong, name "
            "their encoding (--step-encoding shift_jis, gbk, cp1251, euc_kr)",
            names=", ".join(f"“{name}”" for name in names),
        )
        yield Note(GeometryCode.NAME, words)


_PRODUCT = re.compile(rb"=\s*+PRODUCT\s*+\(\s*+'((?:[^']|'')*+)'\s*+,\s*+'((?:[^']|'')*+)'")


def only_product(path: Path) -> tuple[str, ...]:
    """Return number and name of a STEP file's product; nothing if it holds several, or cannot be read."""
    try:
        with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
            found = list(islice(_PRODUCT.finditer(data), 2))
            words = {decoded(word).strip() for match in found for word in match.groups()}
    except (OSError, ValueError):
        return ()
    return tuple(sorted(words - {""})) if len(found) == 1 else ()


def _refuse_bombs(path: Path, products: Products, most: int) -> None:
    # Before the kernel sees it: a kilobyte of assemblies of assemblies keeps it busy forever.
    try:
        count = count_placed(products)
    except InputError as error:
        raise DocumentError(str(path), str(error)) from error
    if count > most:
        raise DocumentError(
            str(path),
            message(
                "it unfolds to {count} placed parts, more than the {most} allowed", count=count, most=most
            ),
        )


GROUP_FROM = 1_000
GROUP_SIZE = 100
MARK = "silo-mod:group:"
"""What the products of our groups are called; no file has it."""

_REFERENCE = re.compile(rb"'(?:[^']|'')*'|#(\d+)")
_TIED = re.compile(
    rb"(?<![A-Z_])REPRESENTATION_RELATIONSHIP\s*+\((?:'(?:[^']++|'')*+'|[\s,$])*+#(\d++)\s*+,\s*+#(\d++)"
)
_MOVED = re.compile(rb"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION\s*\(\s*#(\d+)")
_DATA_END = re.compile(rb"ENDSEC\s*;\s*END-ISO-10303-21")


@dataclass(frozen=True, slots=True)
class _Use:
    """One use of a part in an assembly: its occurrence, the relationship that places it, and the items of
    the assembly's representation that the placement speaks of."""

    occurrence: int
    relationship: int
    items: tuple[int, ...]


@dataclass(eq=False)
class _Flat:
    """An assembly with too many uses. ``context`` of its representation, ``about`` of its definition."""

    definition: int
    representation: int
    context: int
    about: int
    product_context: tuple[int, ...]
    uses: list[_Use] = field(default_factory=list)


def regrouped(source: Part21, products: Products) -> tuple[bytes | None, int]:
    """Put groups into the flat assemblies of a text. Returns the new text, and how many entities were added
    at its end.

    Returns (None, 0) if no assembly is flat, or if nothing can be done.
    """
    counts: dict[int, int] = defaultdict(int)
    for assembly, _ in products.uses:
        counts[assembly] += 1
    flat = [assembly for assembly, count in counts.items() if count >= GROUP_FROM]
    if not flat:
        return None, 0
    data = source.data
    texts = [_flat(source, assembly) for assembly in flat]
    cuttable = [flat_part for flat_part in texts if flat_part is not None]
    end = _DATA_END.search(data)
    if not cuttable or end is None:
        return None, 0
    edits: list[tuple[int, int, bytes]] = []
    added: list[str] = []
    for flat_part in cuttable:
        for start in range(0, len(flat_part.uses), GROUP_SIZE):
            group = flat_part.uses[start : start + GROUP_SIZE]
            first = source.highest + 1 + len(added)
            added += _group(flat_part, group, first)
            for use in group:
                edits += _replaced(source, use.occurrence, flat_part.definition, first + 2)
                edits += _replaced(source, use.relationship, flat_part.representation, first + 8)
    edits.append((end.start(), end.start(), "".join(added).encode("ascii")))
    return _edited(data, edits), len(added)


_GROUP = """\
#{0}=PRODUCT('{name}','{name}','',({contexts}));
#{1}=PRODUCT_DEFINITION_FORMATION('','',#{0});
#{2}=PRODUCT_DEFINITION('design','',#{1},#{about});
#{3}=PRODUCT_DEFINITION_SHAPE('','',#{2});
#{4}=CARTESIAN_POINT('',(0.,0.,0.));
#{5}=DIRECTION('',(0.,0.,1.));
#{6}=DIRECTION('',(1.,0.,0.));
#{7}=AXIS2_PLACEMENT_3D('',#{4},#{5},#{6});
#{8}=SHAPE_REPRESENTATION('',({items}),#{context});
#{9}=SHAPE_DEFINITION_REPRESENTATION(#{3},#{8});
#{10}=NEXT_ASSEMBLY_USAGE_OCCURRENCE('{name}','{name}','',#{within},#{2},$);
#{11}=PRODUCT_DEFINITION_SHAPE('','',#{10});
#{12}=ITEM_DEFINED_TRANSFORMATION('','',#{7},#{7});
#{13}=(REPRESENTATION_RELATIONSHIP('','',#{8},#{around})\
REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{12})SHAPE_REPRESENTATION_RELATIONSHIP());
#{14}=CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#{13},#{11});
"""


def _group(flat: _Flat, uses: Sequence[_Use], first: int) -> list[str]:
    """Write the entities of one more sub-assembly at the origin of ``flat``, numbered from ``first``."""
    items = dict.fromkeys((first + 7, *(item for use in uses for item in use.items)))
    text = _GROUP.format(
        *range(first, first + 15),
        name=f"{MARK}{first}",
        contexts=",".join(f"#{number}" for number in flat.product_context),
        items=",".join(f"#{number}" for number in items),
        about=flat.about,
        context=flat.context,
        within=flat.definition,
        around=flat.representation,
    )
    return text.splitlines(keepends=True)


def _flat(source: Part21, definition: int) -> _Flat | None:
    """Read what is needed of one assembly; None if anything differs from the recommended practice."""
    arguments = source.arguments(definition)
    formation = source.arguments(ref(arguments, 2) or 0)
    product = source.arguments(ref(formation, 2) or 0)
    shapes = {first: n for n, (first, *_) in _ends_of(source, "PRODUCT_DEFINITION_SHAPE", 1)}
    defined = {shape: ends for _, (shape, ends, *_) in _ends_of(source, "SHAPE_DEFINITION_REPRESENTATION", 2)}
    representation = defined.get(shapes.get(definition, 0), 0)
    context = ref(source.arguments(representation), 2)
    about = ref(arguments, 3)
    if context is None or about is None or len(product) < 4:
        return None
    flat = _Flat(definition, representation, context, about, refs(product[3]))
    own_items = frozenset(refs(source.arguments(representation)[1]))
    placing = {
        used: placed
        for _, (placed, used, *_) in _ends_of(source, "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION", 2)
    }
    for number, (assembly, *_) in _ends_of(source, "NEXT_ASSEMBLY_USAGE_OCCURRENCE", 2):
        if assembly == definition:
            relationship = placing.get(shapes.get(number, 0), 0)
            tied = _TIED.search(source.body(relationship))
            if tied is None or representation not in (int(tied[1]), int(tied[2])):
                return None
            moved = _MOVED.search(source.body(relationship))
            items = source.references(int(moved[1])) if moved is not None else ()
            flat.uses.append(_Use(number, relationship, tuple(i for i in items if i in own_items)))
    return flat


def _ends_of(source: Part21, keyword: str, least: int) -> Iterator[tuple[int, tuple[int, ...]]]:
    """Yield the entities of one kind that have at least ``least`` references, with these."""
    for number in source.listed(keyword):
        references = source.references(number)
        if len(references) >= least:
            yield number, references


def _replaced(source: Part21, number: int, old: int, new: int) -> Iterator[tuple[int, int, bytes]]:
    """Yield edits that make entity ``number`` refer to ``new`` instead of ``old``."""
    start = source.starts[number]
    for match in _REFERENCE.finditer(source.body(number)):
        if match[1] is not None and int(match[1]) == old:
            yield start + match.start(), start + match.end(), b"#%d" % new


def _edited(data: Buffer, edits: list[tuple[int, int, bytes]]) -> bytes:
    pieces, position = [], 0
    for start, end, text in sorted(edits):
        pieces += [data[position:start], text]
        position = end
    return b"".join([*pieces, data[position:]])


def with_turned_spheres(data: bytes, turns: Mapping[int, SphereTurn]) -> tuple[bytes, int]:
    """Give each face in ``turns`` a sphere of its own, with another axis. Returns the text, and how many
    entities are new.

    Faces and centres are given by their place among all entities of the file, counted from 1.
    """
    wanted = {*turns, *(turn.centre for turn in turns.values())}
    found: dict[int, tuple[int, re.Match[bytes]]] = {}
    highest = 0
    for place, match in enumerate(entities(data), start=1):
        number = int(match[1])
        highest = max(highest, number)
        if place in wanted:
            found[place] = (number, match)
    changes: list[tuple[int, int, bytes]] = []
    added: list[str] = []
    for place, turn in turns.items():
        if place not in found or turn.centre not in found:
            continue
        surface = _SURFACE.match(data, found[place][1].end())
        if surface is None:
            continue
        for axis in (turn.axis, turn.across):
            highest += 1
            added.append(f"#{highest}=DIRECTION('',({axis[0]!r},{axis[1]!r},{axis[2]!r}));")
        centre = found[turn.centre][0]
        added.append(f"#{highest + 1}=AXIS2_PLACEMENT_3D('',#{centre},#{highest - 1},#{highest});")
        added.append(f"#{highest + 2}=SPHERICAL_SURFACE('',#{highest + 1},{turn.radius!r});")
        highest += 2
        changes.append((*surface.span(1), b"%d" % highest))
    end = max(match.start() for match in _DATA_END.finditer(data))
    changes.append((end, end, "\n".join(added).encode("ascii") + b"\n"))
    pieces, position = [], 0
    for start, stop, new in sorted(changes):
        pieces += [data[position:start], new]
        position = stop
    return b"".join((*pieces, data[position:])), len(added)


@dataclass(frozen=True, slots=True)
class SphereTurn:
    """Another axis of a face's sphere: the place of its centre, its radius in the file's unit, the axis and
    the direction of its seam."""

    centre: int
    radius: float
    axis: tuple[float, float, float]
    across: tuple[float, float, float]


_SURFACE = re.compile(rb"\s*'(?:[^']|'')*'\s*,\s*\([^()]*\)\s*,\s*#(\d+)\s*,\s*\.[TF]\.\s*\)")
"""The arguments of a face: its name, its bounds, its surface and on which side of that it is."""
