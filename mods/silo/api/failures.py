# SPDX-License-Identifier: LGPL-2.1-or-later
"""The one place where foreign errors become ours: requests, urllib3, ssl, sockets, JSON, pydantic.

``translated`` wraps the code that may raise them. A test holds the table complete: each exception class that
these libraries define has a line here, so a new one does not slip through as itself.
"""

from __future__ import annotations

import http.client
import json
import socket
import ssl
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import pydantic
import requests
import urllib3.exceptions as u3
from requests import exceptions as rq

from silo.bom.errors import (
    ConfigError,
    InputError,
    NotSentError,
    ServerFaultError,
    SiloError,
    UnreachableError,
)

FOREIGN: tuple[type[Exception], ...] = (
    rq.RequestException,
    u3.HTTPError,
    http.client.HTTPException,
    pydantic.ValidationError,
    pydantic.PydanticUserError,
    RecursionError,
    ValueError,
    OSError,
)


@dataclass(frozen=True)
class Where:
    """What a message needs: whom we asked, for what, and how long we were ready to wait (seconds)."""

    host: str
    subject: str = ""
    connect: float = 0.0
    read: float = 0.0

    @property
    def asked(self) -> str:
        """``host`` or ``host (the BOM of ASM-001)``."""
        return f"{self.host} ({self.subject})" if self.subject else self.host


def _refused(where: Where) -> SiloError:
    return NotSentError(
        f"nothing answers at {where.host}: is the Silo server running, and is the address right? "
        "`silo-mod serve` starts one on this computer"
    )


def _unknown_name(where: Where) -> SiloError:
    return NotSentError(
        f"the name in {where.host} is not known here: check the address, the network or the VPN"
    )


def _slow_connect(where: Where) -> SiloError:
    return NotSentError(
        f"{where.host} could not be reached within {where.connect:g} s: check the network or the VPN"
    )


def _slow_answer(where: Where) -> SiloError:
    return UnreachableError(
        f"{where.asked} was silent for {where.read:g} s; try again, or allow a longer time"
    )


def _broken(where: Where) -> SiloError:
    return UnreachableError(f"{where.asked} closed the connection before the answer was complete; try again")


def _tls(where: Where) -> SiloError:
    return NotSentError(
        f"no secure connection to {where.host}: its certificate is not trusted here, or it speaks no https. "
        "For an own certificate authority give its file in SILO_SSL_VERIFY"
    )


def _proxy(where: Where) -> SiloError:
    return NotSentError(f"the proxy on the way to {where.host} does not let us through; check its settings")


def _address(where: Where) -> SiloError:
    return ConfigError(
        f"{where.host}: this server address cannot be used; write it like https://silo.example.com"
    )


def _header(where: Where) -> SiloError:
    # The library's own text quotes the header's value, which may be the token.
    return ConfigError(f"{where.host}: the token or a header holds characters that HTTP does not allow")


def _loop(where: Where) -> SiloError:
    return ServerFaultError(f"{where.asked} redirects in a circle; check the server address")


def _garbled(where: Where) -> SiloError:
    return ServerFaultError(
        f"{where.asked} answered something that cannot be understood; is this the address of a Silo server?"
    )


def _ours(where: Where) -> SiloError:
    return InputError(f"{where.asked}: what was to be sent cannot be put into a request")


# The most specific class wins, by the order in the class's own ancestry (its MRO).
TABLE = {
    rq.RequestException: _broken,
    rq.ConnectionError: _broken,
    rq.ConnectTimeout: _slow_connect,
    rq.ReadTimeout: _slow_answer,
    rq.Timeout: _slow_answer,
    rq.SSLError: _tls,
    rq.ProxyError: _proxy,
    rq.InvalidProxyURL: _proxy,
    rq.ChunkedEncodingError: _broken,
    rq.ContentDecodingError: _garbled,
    rq.StreamConsumedError: _garbled,
    rq.InvalidJSONError: _garbled,
    rq.JSONDecodeError: _garbled,
    rq.HTTPError: _garbled,
    rq.RetryError: _broken,
    rq.TooManyRedirects: _loop,
    rq.URLRequired: _address,
    rq.MissingSchema: _address,
    rq.InvalidSchema: _address,
    rq.InvalidURL: _address,
    rq.InvalidHeader: _header,
    rq.UnrewindableBodyError: _ours,
    u3.HTTPError: _broken,
    u3.PoolError: _broken,
    u3.RequestError: _broken,
    u3.MaxRetryError: _broken,
    u3.HostChangedError: _loop,
    u3.SSLError: _tls,
    u3.ProxyError: _proxy,
    u3.ProxySchemeUnknown: _proxy,
    u3.ProxySchemeUnsupported: _proxy,
    u3.DecodeError: _garbled,
    u3.ProtocolError: _broken,
    u3.IncompleteRead: _broken,
    u3.InvalidChunkLength: _broken,
    u3.TimeoutError: _slow_answer,
    u3.TimeoutStateError: _slow_answer,
    u3.ReadTimeoutError: _slow_answer,
    u3.ConnectTimeoutError: _slow_connect,
    u3.NewConnectionError: _refused,
    u3.EmptyPoolError: _broken,
    u3.ClosedPoolError: _broken,
    u3.LocationValueError: _address,
    u3.LocationParseError: _address,
    u3.URLSchemeUnknown: _address,
    u3.ResponseError: _broken,
    u3.ResponseNotChunked: _garbled,
    u3.BodyNotHttplibCompatible: _garbled,
    u3.InvalidHeader: _garbled,
    u3.HeaderParsingError: _garbled,
    u3.UnrewindableBodyError: _ours,
    http.client.HTTPException: _broken,
    pydantic.ValidationError: _garbled,
    pydantic.PydanticUserError: _garbled,
    json.JSONDecodeError: _garbled,
    UnicodeError: _garbled,
    RecursionError: _garbled,
    ValueError: _garbled,
    ssl.SSLError: _tls,
    ssl.CertificateError: _tls,
    socket.gaierror: _unknown_name,
    ConnectionRefusedError: _refused,
    TimeoutError: _slow_answer,
    OSError: _broken,
}
for _name, _build in (("NameResolutionError", _unknown_name), ("FullPoolError", _broken)):
    if hasattr(u3, _name):  # urllib3 2
        TABLE[getattr(u3, _name)] = _build

# Wrappers whose reason says more than they do.
_WRAPPERS = (rq.ConnectionError, rq.ChunkedEncodingError, u3.MaxRetryError, u3.ProtocolError)


def translate(error: Exception, where: Where) -> SiloError:
    """Our error for a foreign one, in plain words; never quotes a header."""
    told = _innermost(error)
    for kind in type(told).__mro__:
        if kind in TABLE:
            return TABLE[kind](where)
    return _garbled(where)


@contextmanager
def translated(where: Where) -> Iterator[None]:
    """Within, foreign errors leave as ours; ours pass."""
    try:
        yield
    except SiloError:
        raise
    except FOREIGN as error:
        if isinstance(error, requests.RequestException):
            # They carry the whole request, the token in its headers included; nobody needs that further up.
            error.request = error.response = None
        raise translate(error, where) from error


def _innermost(error: Exception) -> Exception:
    """Follow the wrappers down: "max retries exceeded" is only the outside of "connection refused"."""
    for _ in range(8):
        inner = getattr(error, "reason", None) or next(iter(error.args), None)
        if type(error) not in _WRAPPERS or not isinstance(inner, Exception):
            return error
        error = inner
    return error
