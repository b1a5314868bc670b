# SPDX-License-Identifier: LGPL-2.1-or-later
"""Who acts on the server, and what they may do: roles, the scopes of tokens, and the caller of a request."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Role(StrEnum):
    """Who may do what; each role includes the ones before it."""

    VIEWER = "viewer"  # reads everything, manages the own tokens
    EDITOR = "editor"  # changes items, BOMs and files
    ADMIN = "admin"  # users, mode, audit

    def covers(self, needed: Role) -> bool:
        """Return True if this role may do what ``needed`` may."""
        order = list(Role)
        return order.index(self) >= order.index(needed)


class Scope(StrEnum):
    """What a token may be used for, at most; each scope includes the ones before it."""

    READ = "read"
    WRITE = "write"
    ADMIN = "admin"

    @property
    def role(self) -> Role:
        """Return the highest role that a token of this scope can have."""
        return {Scope.READ: Role.VIEWER, Scope.WRITE: Role.EDITOR, Scope.ADMIN: Role.ADMIN}[self]

    def covers(self, wanted: Scope) -> bool:
        """Return True if this scope includes ``wanted``."""
        return self.role.covers(wanted.role)


@dataclass(frozen=True, slots=True)
class Actor:
    """Who does something, and from where.

    role
        what this caller may do: the user's role, or less if the token's scope is narrower.
    scope, expires_at
        those of the token (``auth_source`` token); ``expires_at`` None = until it is revoked.
    credential_id
        of the token or session, as the tree of credentials has it; None for the server itself.
    by_link
        a session that a login link began: the user may set a password without naming the old one.
    """

    username: str
    role: Role
    user_id: int | None = None
    display_name: str = ""
    auth_source: str = "local"
    address: str = ""
    csrf_token: str | None = None
    session_hash: str | None = None
    scope: Scope = Scope.ADMIN
    expires_at: str | None = None
    by_link: bool = False
    credential_id: int | None = None

    @property
    def by_token(self) -> bool:
        return self.auth_source == "token"

    @property
    def own_id(self) -> int:
        """Return the user's id; each caller that a guard let in is a user."""
        assert self.user_id is not None
        return self.user_id


SYSTEM = Actor("system", Role.ADMIN, auth_source="system")
