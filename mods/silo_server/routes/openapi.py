# SPDX-License-Identifier: LGPL-2.1-or-later
"""The values in the OpenAPI document: it calls valid what the server takes, and nothing else.

Some requests are refused although their form is right: a CSV without a header row, a merge that names an
unknown part number. Such an operation says why under ``x-valid-but-refused``, and so does its 400.
"""

from __future__ import annotations

from typing import Any

from silo.api.wire import RELEASE_LABEL, HeldReport, MergeRequest
from silo.bom.quantities import LARGEST_QUANTITY
from silo.bom.text import REFUSED_CHARACTERS
from silo_server.schema import ITEM_TYPES, find_schema
from silo_server.services.access.passwords import MAX_PASSWORD, MIN_PASSWORD
from silo_server.services.access.users import USERNAME_FORM
from silo_server.services.items import NUMBER_FORM
from silo_server.user_json import MAX_KEY, MAX_NUMBER

Schema = dict[str, Any]
ALLOWED = f"^[^{REFUSED_CHARACTERS}]*$"
_BLANK = rf"[^\S{REFUSED_CHARACTERS}]"
NOTHING: Schema = {"type": "null"}
REFUSED = "x-valid-but-refused"


def text(longest: int, **more: Any) -> Schema:
    """Make the schema of a text of allowed characters."""
    return {"type": "string", "maxLength": longest, "pattern": ALLOWED, **more}


def or_null(schema: Schema) -> Schema:
    """Make a schema that also allows null."""
    return {"anyOf": [schema, NOTHING]}


def part_number(*, or_empty: bool = False) -> Schema:
    """Make the schema of a new part number; ``or_empty``: an empty text means that there is none."""
    optional = "?" if or_empty else ""
    return {
        "type": "string",
        "maxLength": 200,
        "pattern": f"^({_BLANK}*{NUMBER_FORM.pattern}{_BLANK}*){optional}$",
        "description": "1 to 64 characters without tabs, line ends and other control characters; unique in "
        "any case. In an address: quoted, with ~2F for /, ~7E for ~, ~2E for each dot of a number of dots "
        "alone, and ~_ before a word of the API such as search; %2F is read too",
    }


def refused(reason: str) -> Schema:
    """Return ``openapi_extra`` that says why an operation refuses (400) requests of the right form."""
    return {REFUSED: reason}


CATEGORIES = list(find_schema(None).categories)

CATEGORY: Schema = {
    "type": "string",
    "enum": CATEGORIES,
    "description": "a category of the part-number schema; lower case is taken as well",
}

CATEGORY_OR_EMPTY: Schema = {**CATEGORY, "enum": [*CATEGORIES, ""]}
ITEM_TYPE: Schema = {"type": "string", "enum": list(ITEM_TYPES)}
UUID: Schema = {"type": "string", "format": "uuid"}
USERNAME: Schema = {"type": "string", "pattern": f"^{USERNAME_FORM.pattern}$"}
PASSWORD: Schema = text(MAX_PASSWORD, minLength=MIN_PASSWORD)
SHA256: Schema = {"type": "string", "pattern": "^[0-9A-Fa-f]{64}$"}

# An item gets its number from one or the other.
NUMBER_OR_CATEGORY: Schema = {
    "anyOf": [
        {"required": ["category"], "properties": {"category": {"enum": CATEGORIES}}},
        {"required": ["part_number"], "properties": {"part_number": {"type": "string", "minLength": 1}}},
    ]
}

_TIME = "T([01][0-9]|2[0-3]):[0-5][0-9]:[0-5][0-9](\\.[0-9]{1,6})?(Z|[+-](0[0-9]|1[0-4]):[0-5][0-9])"
_DATE = "[1-9][0-9]{3}-[0-9]{2}-[0-9]{2}"

_AT: Schema = {
    "type": "string",
    "maxLength": 40,
    "format": "date-time",
    "pattern": f"^{_DATE}{_TIME}$",
    "description": "a time with its zone (ISO 8601)",
}

POINT: Schema = {
    "anyOf": [
        {"type": "string", "enum": ["now"]},
        {
            "type": "string",
            "pattern": "^[0-9]{1,18}$",
            "description": "the id of a change, 0 = no lines",
        },
        _AT,
    ]
}

MOMENT: Schema = {
    "anyOf": [
        _AT,
        {"type": "string", "format": "date", "pattern": f"^{_DATE}$"},
        {"type": "string", "pattern": "^r[0-9]{1,9}$", "description": "a revision of the item"},
        {"type": "string", "pattern": f"^({RELEASE_LABEL})$", "description": "a frozen revision's label"},
    ]
}

_ANY_JSON: Schema = {"title": "JsonValue"}
_JSON = "#/components/schemas/JsonValue"
_KEY = {"maxLength": MAX_KEY, "pattern": ALLOWED}
# pydantic has no way to refer to a schema that it did not make; :func:`complete` puts the reference in.
JSON_OBJECT: Schema = {"type": "object", "propertyNames": _KEY, "additionalProperties": _ANY_JSON}

_JSON_VALUE: Schema = {
    "description": "JSON of at most 32 levels and 256 KiB, with numbers that a double can hold"
    " (send longer ones as text)",
    "anyOf": [
        NOTHING,
        {"type": "boolean"},
        {"type": "number", "minimum": -MAX_NUMBER, "maximum": MAX_NUMBER},
        {"type": "string", "pattern": ALLOWED},
        {"type": "array", "items": {"$ref": _JSON}},
        {"type": "object", "propertyNames": _KEY, "additionalProperties": {"$ref": _JSON}},
    ],
}

_NOT_BLANK = rf"^[^{REFUSED_CHARACTERS}]*[^\s{REFUSED_CHARACTERS}][^{REFUSED_CHARACTERS}]*$"

# What services.bom.merge_request asks of the wire model's fields.
_MERGE: dict[str, dict[str, Schema]] = {
    "MergeRequest": {
        "source": {"description": "not read: the entries are an assembly's"},
        "sync_id": or_null(text(128, minLength=1)),
        "dry_run": or_null({"type": "boolean", "default": False}),
    },
    "MergeEntry": {
        "child_part_number": {
            "type": "string",
            "maxLength": 200,
            "pattern": _NOT_BLANK,
        },
        "quantity": {"type": "number", "exclusiveMinimum": 0, "maximum": LARGEST_QUANTITY},
        "source": {"description": "not read: the entries are an assembly's"},
    },
    "Component": {"file": text(4096), "object": text(1024)},
    "HeldReport": {
        "left_out": {"type": "array", "minItems": 1, "items": {"$ref": "#/components/schemas/LeftOutPart"}}
    },
    "SourceDocument": {
        "file": text(4096),
        "sha256": or_null(SHA256),
        "revision": or_null({"type": "integer", "minimum": 0, "maximum": 2**31 - 1}),
    },
    "LeftOutPart": {
        "reason": text(32, minLength=1),
        "name": text(1024),
        "file": text(4096),
        "object": text(1024),
        "message": text(4096),
        "quantity": {"type": "number", "minimum": 0, "maximum": LARGEST_QUANTITY},
    },
}


def complete(document: Schema) -> Schema:
    """Add to FastAPI's document what FastAPI does not know about this server."""
    for operations in document["paths"].values():
        for operation in operations.values():
            # We answer 400; FastAPI by itself would answer 422.
            answers = operation.get("responses", {})
            answers.pop("422", None)
            if REFUSED in operation:
                answers["400"]["description"] += f". Also if the form is right: {operation[REFUSED]}"
    schemas = document["components"]["schemas"]
    for name in ("HTTPValidationError", "ValidationError"):
        schemas.pop(name, None)
    # The merge, and the report of a held BOM, read their bodies by themselves (services.bom.merge_request);
    # the form is the wire model's.
    merge = MergeRequest.model_json_schema(ref_template="#/components/schemas/{model}")
    schemas.update(merge.pop("$defs"), MergeRequest=merge, JsonValue=_JSON_VALUE)
    held = HeldReport.model_json_schema(ref_template="#/components/schemas/{model}")
    schemas["HeldReport"] = {key: value for key, value in held.items() if key != "$defs"}
    for model, fields in _MERGE.items():
        schemas[model]["properties"].update(fields)
    _refer(document)
    return document


def _refer(part: Any) -> None:
    below = part.values() if isinstance(part, dict) else part if isinstance(part, list) else ()
    if isinstance(part, dict) and part.get("additionalProperties") == _ANY_JSON:
        part["additionalProperties"] = {"$ref": _JSON}
    for reference in below:
        _refer(reference)
