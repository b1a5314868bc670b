# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where a server is: the base URL rule, the paths below it, and which other addresses are the same server.

``http(s)://host[:port]`` means REST under ``/api``. An address with a path of its own is used as it is: thus
``https://host/silo/api`` works behind a proxy (the older workbench reads both the same way).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from urllib.parse import SplitResult, quote, urljoin, urlsplit, urlunsplit

from silo.bom.errors import ConfigError, InputError

_DEFAULT_PORTS = {"http": 80, "https": 443}
_LOOPBACK = ("localhost", "::1")
_ADVICE = "write it like https://silo.example.com or http://127.0.0.1:8080"

Origin = tuple[str, str, int]


def origin_of(url: str) -> Origin:
    """(scheme, host, port) of an absolute URL, lower case, the port always given.

    Raises :class:`ConfigError` where it is no http(s) URL.
    """
    parts = _http(url)
    return (parts.scheme, parts.hostname or "", parts.port or _DEFAULT_PORTS[parts.scheme])


def may_carry_token(sender: Origin, receiver: Origin) -> bool:
    """True where a redirect from one to the other may take the token along.

    Only the same server, or its own http → https upgrade on the standard ports.
    """
    upgrade = sender[0] == "http" and sender[2] == 80 and receiver == ("https", sender[1], 443)
    return sender == receiver or upgrade


def canonical(url: str) -> str:
    """One spelling for all addresses of one server: what waits for it is found again under any of them.

    Text that is no address is given back as it is.
    """
    try:
        address = ServerAddress.parse(url)
        scheme, host, port = address.origin
    except ConfigError:
        return url.strip()
    bare = f"[{host}]" if ":" in host else host
    return f"{scheme}://{bare}:{port}{urlsplit(address.api_root).path}"


@dataclass(frozen=True)
class ServerAddress:
    """A Silo server: ``api_root`` for requests, ``web_root`` for pages and ``/ready``, without end slash."""

    api_root: str
    web_root: str

    @classmethod
    def parse(cls, text: str) -> ServerAddress:
        """Read an address as a person writes it; raises :class:`ConfigError` with what to write instead.

        All spellings of one address give the same: capitals in the host, the scheme's own port, slashes at
        the end or doubled. What waits for a server is found by this form.
        """
        parts = _split(text.strip())
        path = re.sub("/+", "/", parts.path).rstrip("/")
        bare = urlunsplit((parts.scheme, _netloc(parts), "", "", ""))
        if not path:
            return cls(api_root=bare + "/api", web_root=bare)
        return cls(api_root=bare + path, web_root=bare + path.removesuffix("/api"))

    @property
    def origin(self) -> Origin:
        """(scheme, host, port)."""
        return origin_of(self.web_root)

    @property
    def host(self) -> str:
        """``host`` or ``host:port``, for messages."""
        return urlsplit(self.web_root).netloc

    @property
    def is_loopback(self) -> bool:
        """True for this computer itself."""
        name = self.origin[1]
        return name in _LOOPBACK or name.startswith("127.")

    def api(self, *segments: str) -> str:
        """The URL of an API path; each segment is quoted whole, also a part number with a slash."""
        return "/".join((self.api_root, *(_segment(s) for s in segments)))

    def web(self, path: str) -> str:
        """The full URL of a page such as ``resolve_url``; raises :class:`InputError` for another server's."""
        url = urljoin(self.web_root + "/", path) if path.startswith(("http:", "https:", "//")) else None
        if url is None:
            return f"{self.web_root}/{path.lstrip('/')}"
        if origin_of(url) != self.origin:
            raise InputError(f"{url}: this page is not on {self.host}; it is not opened")
        return url


def _segment(text: str) -> str:
    # Every HTTP library resolves "." and "..": such a part number would ask for something else.
    if text.strip(".") == "" or not text.strip():
        raise InputError(
            f"{text!r} cannot be a part number or an identity: the server could not be asked for it"
        )
    return quote(text, safe="")


def _netloc(parts: SplitResult) -> str:
    host = (parts.hostname or "").rstrip(".")
    name = f"[{host}]" if ":" in host else host
    return name if parts.port in (None, _DEFAULT_PORTS[parts.scheme]) else f"{name}:{parts.port}"


def _split(url: str) -> SplitResult:
    """The parts of a server address."""
    parts = _http(url)
    if any(ord(c) <= 32 or ord(c) == 127 for c in url) or parts.query or parts.fragment:
        raise ConfigError(f"{url!r}: a server address has no blanks, no ? and no #; {_ADVICE}")
    return parts


def _http(url: str) -> SplitResult:
    """The parts of any http(s) URL."""
    try:
        parts = urlsplit(url)
        port_is_valid = parts.port is None or parts.port > 0
    except ValueError:
        raise ConfigError(f"the server address cannot be read; {_ADVICE}") from None
    if parts.username is not None or parts.password is not None:
        # Never quoted in the message: it holds a password.
        raise ConfigError(
            f"the server address holds a user name; leave it out, a token says who you are; {_ADVICE}"
        )
    if parts.scheme not in _DEFAULT_PORTS or not parts.hostname or not port_is_valid:
        raise ConfigError(f"{url!r} is no server address; {_ADVICE}")
    return parts
