# SPDX-License-Identifier: LGPL-2.1-or-later
"""The one place where foreign errors become ours: requests, urllib3, ssl, sockets, JSON, pydantic.

``translated`` wraps the code that may raise them. A test holds the table complete: each exception class that
these libraries define has a line here, so a new one does not slip through as itself.
"""

from __future__ import annotations

import http.client
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
from silo.bom.message import Message, message, template

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
        """Return ``host``, or with the subject ``host (the BOM of ASM-001)``."""
        if not self.subject:
            return self.host
        return message("{host} ({subject})", host=self.host, subject=self.subject)


_Kind = tuple[type[SiloError], str]

_REFUSED: _Kind = (
    NotSentError,
    template(
        "nothing answers at {host}: is the Silo server running, and is the address right? "
        "`silo-mod serve` starts one on this computer"
    ),
)
_UNKNOWN_NAME: _Kind = (
    NotSentError,
    template("the name in {host} is not known here: check the address, the network or the VPN"),
)
_SLOW_CONNECT: _Kind = (
    NotSentError,
    template("{host} could not be reached within {connect} s: check the network or the VPN"),
)
_SLOW_ANSWER: _Kind = (
    UnreachableError,
    template("{asked} was silent for {read} s; try again, or allow a longer time"),
)
_BROKEN: _Kind = (
    UnreachableError,
    template("{asked} closed the connection before the answer was complete; try again"),
)
_TLS: _Kind = (
    NotSentError,
    template(
        "no secure connection to {host}: its certificate is not trusted here, or it speaks no https. "
        "For an own certificate authority give its file in SILO_SSL_VERIFY"
    ),
)
_PROXY: _Kind = (
    NotSentError,
    template("the proxy on the way to {host} does not let us through; check its settings"),
)
_ADDRESS: _Kind = (
    ConfigError,
    template("{host}: this server address cannot be used; write it like https://silo.example.com"),
)
# The library's own text quotes the header's value, which may be the token.
_HEADER: _Kind = (
    ConfigError,
    template("{host}: the token or a header holds characters that HTTP does not allow"),
)
_LOOP: _Kind = (ServerFaultError, template("{asked} redirects in a circle; check the server address"))
_GARBLED: _Kind = (
    ServerFaultError,
    template("{asked} answered something that cannot be understood; is this the address of a Silo server?"),
)
_OURS: _Kind = (InputError, template("{asked}: what was to be sent cannot be put into a request"))

_REQUESTS: tuple[tuple[_Kind, str], ...] = (
    (_BROKEN, "RequestException ConnectionError ChunkedEncodingError RetryError"),
    (_SLOW_CONNECT, "ConnectTimeout"),
    (_SLOW_ANSWER, "ReadTimeout Timeout"),
    (_TLS, "SSLError"),
    (_PROXY, "ProxyError InvalidProxyURL"),
    (_GARBLED, "ContentDecodingError StreamConsumedError InvalidJSONError JSONDecodeError HTTPError"),
    (_LOOP, "TooManyRedirects"),
    (_ADDRESS, "URLRequired MissingSchema InvalidSchema InvalidURL"),
    (_HEADER, "InvalidHeader"),
    (_OURS, "UnrewindableBodyError"),
)
_URLLIB3: tuple[tuple[_Kind, str], ...] = (
    (
        _BROKEN,
        "HTTPError PoolError RequestError MaxRetryError ProtocolError IncompleteRead "
        "InvalidChunkLength EmptyPoolError ClosedPoolError ResponseError FullPoolError",
    ),
    (_LOOP, "HostChangedError"),
    (_TLS, "SSLError"),
    (_PROXY, "ProxyError ProxySchemeUnknown ProxySchemeUnsupported"),
    (_GARBLED, "DecodeError ResponseNotChunked BodyNotHttplibCompatible InvalidHeader HeaderParsingError"),
    (_SLOW_ANSWER, "TimeoutError TimeoutStateError ReadTimeoutError"),
    (_SLOW_CONNECT, "ConnectTimeoutError"),
    (_REFUSED, "NewConnectionError"),
    (_ADDRESS, "LocationValueError LocationParseError URLSchemeUnknown"),
    (_OURS, "UnrewindableBodyError"),
    (_UNKNOWN_NAME, "NameResolutionError"),
)
# The most specific class wins, by the order in the class's own ancestry (its MRO).
TABLE: dict[type, _Kind] = {
    getattr(library, name): kind
    for library, rows in ((rq, _REQUESTS), (u3, _URLLIB3))
    for kind, names in rows
    for name in names.split()
    if hasattr(library, name)  # some are of urllib3 2 alone
}
TABLE |= {
    http.client.HTTPException: _BROKEN,
    pydantic.ValidationError: _GARBLED,
    pydantic.PydanticUserError: _GARBLED,
    UnicodeError: _GARBLED,
    RecursionError: _GARBLED,
    ValueError: _GARBLED,
    ssl.SSLError: _TLS,
    socket.gaierror: _UNKNOWN_NAME,
    ConnectionRefusedError: _REFUSED,
    TimeoutError: _SLOW_ANSWER,
    OSError: _BROKEN,
}

# Wrappers less informative than their cause.
_WRAPPERS = (rq.ConnectionError, rq.ChunkedEncodingError, u3.MaxRetryError, u3.ProtocolError)


def translate(error: Exception, where: Where) -> SiloError:
    """Turn an error of another library into one of ours, in plain words. It never quotes a header."""
    exception = _innermost(error)
    kind, text = next((TABLE[cause] for cause in type(exception).__mro__ if cause in TABLE), _GARBLED)
    limits = {"connect": f"{where.connect:g}", "read": f"{where.read:g}"}
    return kind(Message(text, {"host": where.host, "asked": where.asked, **limits}))


@contextmanager
def translated(where: Where) -> Iterator[None]:
    """Turn errors of other libraries inside the block into ours."""
    try:
        yield
    except SiloError:
        raise
    except FOREIGN as error:
        if isinstance(error, requests.RequestException):
            # They hold the whole request, including the token in its headers; no caller needs that.
            error.request = error.response = None
        raise translate(error, where) from error


def _innermost(error: Exception) -> Exception:
    """Follow wrapped errors to the innermost: "max retries exceeded" is only the outside of "connection
    refused".
    """
    for _ in range(8):
        inner = getattr(error, "reason", None) or next(iter(error.args), None)
        if type(error) not in _WRAPPERS or not isinstance(inner, Exception):
            return error
        error = inner
    return error
