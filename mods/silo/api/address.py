# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where a server is: the rule for its base URL, the paths below it, which addresses are the same server.

``http(s)://host[:port]`` means REST under ``/api``. An address with a path of its own is used as it is: so
``https://host/silo/api`` works behind a proxy (the older workbench reads both the same way).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from ipaddress import ip_address
from urllib.parse import SplitResult, quote, urljoin, urlsplit

from silo.bom.errors import ConfigError, InputError
from silo.bom.items.part_address import part_segment
from silo.bom.message import message

_DEFAULT_PORTS = {"http": 80, "https": 443}
_LOOPBACK = ("localhost", "::1")
_ADVICE = message("write it like https://silo.example.com or http://127.0.0.1:8080")

Origin = tuple[str, str, int]


def origin_of(url: str) -> Origin:
    """Return (scheme, host, port) of an absolute URL, in lower case, always with the port.

    Raises :class:`ConfigError` if it is no http(s) URL.
    """
    parts = _http(url)
    return (parts.scheme, _one_spelling(parts.hostname or ""), parts.port or _DEFAULT_PORTS[parts.scheme])


def may_carry_token(sender: Origin, receiver: Origin) -> bool:
    """Return True if a redirect from ``sender`` to ``receiver`` may take the token along.

    True only for the same server, and for its own http → https upgrade on the standard ports.
    """
    upgrade = sender[0] == "http" and sender[2] == 80 and receiver == ("https", sender[1], 443)
    return sender == receiver or upgrade


def canonical(url: str) -> str:
    """Return the one spelling of all addresses of a server, by which the outbox finds what waits for it.

    A text that is no address is returned unchanged.
    """
    try:
        address = ServerAddress.parse(url)
        scheme, host, port = address.origin
    except ConfigError:
        return url.strip()
    bare = f"[{host}]" if ":" in host else host
    return f"{scheme}://{bare}:{port}{urlsplit(address.api_root).path}"


class Word(str):
    """A word of the API, where a part number could stand."""

    __slots__ = ()


@dataclass(frozen=True)
class ServerAddress:
    """A Silo server: ``api_root`` for requests, ``web_root`` for pages and ``/ready``, without end slash."""

    api_root: str
    web_root: str

    @classmethod
    def parse(cls, text: str) -> ServerAddress:
        """Read an address as a user writes it; raises :class:`ConfigError` with what to write instead.

        All spellings of one address give the same value: capitals in the host, the scheme's own port, slashes
        at the end or doubled. The outbox finds what waits for a server by this form.
        """
        text = text.strip()
        # People type a server on their own computer without a scheme; for any other it is not guessed.
        here = re.match(r"(localhost|127\.[\d.]+|\[::1\])(:\d+)?(/|$)", text, re.IGNORECASE)
        text = f"http://{text}" if here else text
        parts = _http(text)
        if any(ord(c) <= 32 or ord(c) == 127 for c in text) or parts.query or parts.fragment:
            raise ConfigError(
                message(
                    "{text}: a server address has no blanks, no ? and no #; {advice}",
                    text=repr(text),
                    advice=_ADVICE,
                )
            )
        path = re.sub("/+", "/", parts.path).rstrip("/")
        host = _one_spelling((parts.hostname or "").rstrip("."))
        port = f":{parts.port}" if parts.port not in (None, _DEFAULT_PORTS[parts.scheme]) else ""
        bare = f"{parts.scheme}://[{host}]{port}" if ":" in host else f"{parts.scheme}://{host}{port}"
        if not path:
            return cls(api_root=bare + "/api", web_root=bare)
        return cls(api_root=bare + path, web_root=bare + path.removesuffix("/api"))

    @property
    def origin(self) -> Origin:
        """Return (scheme, host, port)."""
        return origin_of(self.web_root)

    @property
    def host(self) -> str:
        """Return ``host`` or ``host:port``, for messages."""
        return urlsplit(self.web_root).netloc

    @property
    def is_loopback(self) -> bool:
        """Return True if the address is this computer."""
        name = self.origin[1]
        return name in _LOOPBACK or name.startswith("127.")

    def api(self, *segments: str) -> str:
        """Return the URL of an API path. Each segment is quoted, also the slash in a part number.

        A :class:`Word` of the API stays as it is; a part number that is one, or dots alone, is escaped.
        """
        if not all(text.strip() for text in segments):
            raise InputError(
                message("a part number or an identity is empty: the server cannot be asked for it")
            )
        return "/".join((self.api_root, *map(_segment, segments)))

    def web(self, path: str) -> str:
        """Return the full URL of a page such as ``resolve_url``. Raises :class:`InputError` for a page of
        another server.
        """
        url = urljoin(self.web_root + "/", path) if path.startswith(("http:", "https:", "//")) else None
        if url is None:
            return f"{self.web_root}/{path.lstrip('/')}"
        if origin_of(url) != self.origin:
            raise InputError(
                message("{url}: this page is not on {host}; it is not opened", url=url, host=self.host)
            )
        return url


def _segment(text: str) -> str:
    # Any server of this API reads a quoted slash; the other escapes are read by silo-mod's.
    return quote(text, safe="") if isinstance(text, Word) or "/" in text else part_segment(text)


def _one_spelling(host: str) -> str:
    """Return the short form of an IPv6 address, which has several; any other host as it is."""
    if ":" not in host:
        return host
    try:
        return ip_address(host).compressed
    except ValueError:
        return host


def _http(url: str) -> SplitResult:
    """Split an http(s) URL. Raises ConfigError if it is none, or if it holds a user name."""
    try:
        parts = urlsplit(url)
        port_is_valid = parts.port is None or parts.port > 0
    except ValueError:
        raise ConfigError(message("the server address cannot be read; {advice}", advice=_ADVICE)) from None
    if parts.username is not None or parts.password is not None:
        # Never quoted in the message: it holds a password.
        raise ConfigError(
            message(
                "the server address holds a user name; leave it out, a token says who you are; {advice}",
                advice=_ADVICE,
            )
        )
    if parts.scheme not in _DEFAULT_PORTS or not parts.hostname or not port_is_valid:
        raise ConfigError(message("{url} is not a server address; {advice}", url=repr(url), advice=_ADVICE))
    return parts


def same_server(url: str, other: str | None) -> bool:
    """Return True if two addresses, as people write them, are one server; a token for one is valid for the
    other.
    """
    if not url or not other:
        return False
    try:
        return ServerAddress.parse(url).origin == ServerAddress.parse(other).origin
    except InputError:  # a text that is no address has no token
        return False
