# SPDX-License-Identifier: LGPL-2.1-or-later
"""Foreign errors become ours in one table, and the table is complete."""

from __future__ import annotations

import http.client
import json
import socket
import ssl
from collections.abc import Iterator

import pydantic
import pytest
import requests.exceptions
import urllib3.exceptions

from silo.api.foreign import FOREIGN, TABLE, Where, translate, translated
from silo.bom.errors import NotFoundError, ServerFaultError, SiloError, UnreachableError

WHERE = Where("silo.example.com", "item F01-0001", 5, 30)


def exceptions_of(module: object) -> Iterator[type[Exception]]:
    """The exception classes that a library defines itself; warnings are no errors."""
    for name in dir(module):
        kind = getattr(module, name)
        if isinstance(kind, type) and issubclass(kind, Exception) and not issubclass(kind, Warning):
            yield kind


LIBRARIES = dict.fromkeys([*exceptions_of(requests.exceptions), *exceptions_of(urllib3.exceptions)])
STANDARD = [
    (ssl.SSLCertVerificationError(1, "x"), UnreachableError),
    (socket.gaierror(-2, "x"), UnreachableError),
    (TimeoutError(), UnreachableError),
    (ConnectionRefusedError(), UnreachableError),
    (ConnectionResetError(), UnreachableError),
    (OSError(113, "no route to host"), UnreachableError),
    (http.client.BadStatusLine("x"), UnreachableError),
    (json.JSONDecodeError("x", "y", 0), ServerFaultError),
    (UnicodeDecodeError("utf-8", b"x", 0, 1, "bad"), ServerFaultError),
    (RecursionError(), ServerFaultError),
    (ValueError("Exceeds the limit for integer string conversion"), ServerFaultError),
    (pydantic.ValidationError.from_exception_data("Item", []), ServerFaultError),
]


@pytest.mark.parametrize("kind", LIBRARIES, ids=lambda kind: f"{kind.__module__}.{kind.__name__}")
def test_every_error_of_the_libraries_has_its_line(kind: type[Exception]) -> None:
    """A new class in a library needs a decision here, not a guess at run time."""
    theirs = kind.__module__.startswith(("requests", "urllib3"))
    assert kind in TABLE or not theirs
    assert issubclass(kind, FOREIGN) or not theirs


@pytest.mark.parametrize(
    ("error", "kind"), STANDARD, ids=lambda value: getattr(value, "__name__", repr(value))
)
def test_errors_of_the_standard_library_and_pydantic(error: Exception, kind: type[SiloError]) -> None:
    """Each leaves as one of ours, with the host."""
    with pytest.raises(kind, match=r"silo\.example\.com"), translated(WHERE):
        raise error


def test_only_foreign_errors_are_translated() -> None:
    """Ours pass as they are; programming errors stay visible."""
    with pytest.raises(NotFoundError, match="ours"), translated(WHERE):
        raise NotFoundError("ours")
    with pytest.raises(AttributeError), translated(WHERE):
        raise AttributeError("a mistake of ours")


def test_a_wrapper_says_its_reason() -> None:
    """ "Max retries exceeded" is only the outside of it."""
    refused = urllib3.exceptions.NewConnectionError(None, "x")  # type: ignore[arg-type]
    outside = requests.exceptions.ConnectionError(
        urllib3.exceptions.MaxRetryError(None, "/x", refused)  # type: ignore[arg-type]
    )
    assert "nothing answers at silo.example.com" in str(translate(outside, WHERE))


def test_an_unknown_host_is_reported_as_such() -> None:
    """DNS."""
    told = translate(socket.gaierror(-2, "Name or service not known"), WHERE)
    assert isinstance(told, UnreachableError)
    assert "not known here" in str(told)


def test_the_request_with_its_token_does_not_travel_in_the_cause() -> None:
    """requests' errors carry the whole request."""
    request = requests.Request("GET", "http://h", headers={"Authorization": "Bearer silo_secret"}).prepare()
    with pytest.raises(UnreachableError) as caught, translated(WHERE):
        raise requests.exceptions.ReadTimeout("slow", request=request)
    assert isinstance(caught.value.__cause__, requests.exceptions.ReadTimeout)
    assert caught.value.__cause__.request is None


def test_messages_name_host_question_and_time() -> None:
    """Wanted, got, where, what to do."""
    assert str(translate(requests.exceptions.ReadTimeout("x"), WHERE)) == (
        "silo.example.com (item F01-0001) was silent for 30 s; try again, or allow a longer time"
    )
    garbled = translate(json.JSONDecodeError("x", "y", 0), WHERE)
    assert isinstance(garbled, ServerFaultError)
