# SPDX-License-Identifier: LGPL-2.1-or-later
"""The pages about the server name every route, every setting and every event; what they show can be read."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from silo_server.run import create_app
from silo_server.settings import _ENVIRONMENT, Settings

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def text() -> str:
    """All pages about the server."""
    return "\n".join(page.read_text("utf-8") for page in sorted(DOCS.glob("server*.md")))


def test_every_route_is_named(text: str, tmp_path: Path) -> None:
    """And no route that there is not."""
    document = create_app(Settings(database_url=f"sqlite:///{tmp_path / 'x.db'}")).openapi()
    named = set(re.findall(r"`(/(?:api/[^`?]*|health|ready|metrics))`", text)) - {"/api/openapi.json"}
    assert named == set(document["paths"])


def test_every_setting_is_named(text: str) -> None:
    """And no setting that there is not."""
    named = set(re.findall(r"SILO_[A-Z_]+", text))
    assert named == set(_ENVIRONMENT.values()) | {"SILO_API_TOKEN", "SILO_PASSWORD_MEMORY"}


def test_every_event_is_named(text: str) -> None:
    """The names that the log knows."""
    source = (Path(__file__).parents[2] / "mods/silo_server/events/announce.py").read_text("utf-8")
    for name in re.findall(r'"((?:item|revision|bom|server)[._][a-z]+)", ', source):
        assert f"`{name}`" in text, name
