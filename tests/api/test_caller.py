# SPDX-License-Identifier: LGPL-2.1-or-later
"""What was learned about a server is used by the next run, for a day."""

from __future__ import annotations

from pathlib import Path

import pytest
from real_silo import TOKEN, Moods, real_silo

from silo.api.abilities import KEPT_S, Abilities, load_abilities, save_abilities
from silo.api.client import SiloClient
from silo.cli.main import main

NOBODY = "00000000-0000-4000-8000-000000000000"


def test_it_is_kept_per_server_for_a_day(tmp_path: Path) -> None:
    """Not longer, not for another server, and not in the future of a clock that was set back."""
    path = tmp_path / "cache" / "servers.json"
    known = Abilities(batch=False, strict=True, keeps_item_ids=True, schemas={"kindred-rd": "acme"})
    save_abilities(path, "http://a", known, clock=lambda: 1000.0)
    save_abilities(path, "http://b", Abilities(batch=True), clock=lambda: 1000.0)
    assert load_abilities(path, "http://a", clock=lambda: 1000.0 + KEPT_S - 1) == known
    for now in (1000.0 + KEPT_S, 999.0):
        assert load_abilities(path, "http://a", clock=lambda now=now: now) == Abilities()  # type: ignore[misc]
    assert load_abilities(path, "http://c") == Abilities()


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"http://a": 3}', '{"http://a": {"learned_at": 1, "strict": "yes"}}']
)
def test_a_damaged_memory_is_none(tmp_path: Path, text: str) -> None:
    """It costs some requests, never an answer."""
    path = tmp_path / "servers.json"
    path.write_text(text, encoding="utf-8")
    assert load_abilities(path, "http://a", clock=lambda: 2.0) == Abilities()


def test_the_next_run_does_not_try_again(tmp_path: Path) -> None:
    """No batch look-up, another schema, strict: each is learned once."""
    memory = tmp_path / "servers.json"
    with real_silo(Moods(strict=True, schemas=("acme",))) as silo:
        for _ in range(2):
            with SiloClient(silo.url, TOKEN, memory=memory) as client:
                schema = client.find_schema("kindred-rd")
                client.get_items_by_uuid([NOBODY])
                client.create_item(schema, "F01", "Bolt", idempotency_key=NOBODY)
        assert silo.seen.count("POST /api/items/by-uuid") == 1
        assert silo.seen.count("GET /api/schemas") == 1
        assert silo.seen.count("POST /api/items") == 3


def test_a_right_is_not_kept(tmp_path: Path) -> None:
    """A viewer's refusal says nothing of the next token."""
    memory = tmp_path / "servers.json"
    with real_silo(Moods(batch=403)) as silo, SiloClient(silo.url, TOKEN, memory=memory) as client:
        client.get_items_by_uuid([NOBODY])
        client.get_items_by_uuid([NOBODY])
        assert silo.seen.count("POST /api/items/by-uuid") == 1
    assert load_abilities(memory, silo.url).batch is None


def doctor(silo: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    code = main(["doctor", "--server", silo, "--token", TOKEN])
    return code, capsys.readouterr().out


@pytest.fixture(autouse=True)
def _home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME"):
        monkeypatch.setenv(name, str(tmp_path / name.lower()))


def test_the_doctor_shows_what_the_server_can(capsys: pytest.CaptureFixture[str]) -> None:
    """And changes nothing."""
    with real_silo(Moods(schemas=("acme",), role="viewer")) as silo:
        code, out = doctor(silo.url, capsys)
        assert silo.items == {}
    assert code == 0
    for word in (
        "normal, version 0.1.0",
        "reads only",
        "acme",
        "one by one",
        "the server does not say",
        "live",
    ):
        assert word in out


def test_the_doctor_names_every_trouble_at_once(capsys: pytest.CaptureFixture[str]) -> None:
    """Exit code 3, and each line says what is wrong."""
    with real_silo(Moods(expired=True)) as silo:
        code, out = doctor(silo.url, capsys)
    assert code == 3
    assert out.count("wants a login") >= 4
