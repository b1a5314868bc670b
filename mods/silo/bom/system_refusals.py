# SPDX-License-Identifier: LGPL-2.1-or-later
"""Why the operating system refused something, in words of ours.

The system's own words have no language of the user's choice, and name no remedy. An error without a sentence
here is shown by its number and its name, by which it can be looked up.
"""

from __future__ import annotations

import errno

from silo.bom.message import Message, message

_REASONS = {
    errno.ENOENT: message("there is no such file or folder"),
    errno.EEXIST: message("a file or folder with this name is there already"),
    errno.ENOTDIR: message("a part of its path is a file, not a folder"),
    errno.EISDIR: message("it is a folder"),
    errno.EACCES: message("this user has no right to it"),
    errno.EPERM: message("this user has no right to do that"),
    errno.ENOSPC: message("the disk is full"),
    errno.EROFS: message("the disk is read-only"),
    errno.EIO: message("the disk reports a fault"),
    errno.EFBIG: message("the file is larger than the disk allows"),
    errno.ENAMETOOLONG: message("its name is too long for this disk"),
    errno.ELOOP: message("its symbolic links lead in a circle"),
    errno.ENOTEMPTY: message("the folder is not empty"),
    errno.EXDEV: message("it lies on another disk"),
    errno.EBUSY: message("another program uses it"),
    errno.ETXTBSY: message("it is a program that runs"),
    errno.EMFILE: message("this program has too many files open"),
    errno.ENFILE: message("this machine has too many files open"),
    errno.ENOMEM: message("this machine has too little memory"),
    errno.ENOEXEC: message("it is no program of this system"),
    errno.EADDRINUSE: message("another program uses this port"),
    errno.EADDRNOTAVAIL: message("this machine has no such address"),
}
# Two more that not every system has: a quota, a network drive that went away.
for _name, _reason in (
    ("EDQUOT", message("this user's share of the disk is used up")),
    ("ESTALE", message("the network drive no longer has it")),
):
    if (_number := getattr(errno, _name, None)) is not None:
        _REASONS[_number] = _reason

# Windows' own numbers of a file that another program has opened; both come as EACCES.
_SHARING = (32, 33)


def why_refused(error: Exception) -> str:
    """Say why the system refused; an error that is none of the system's keeps its own words."""
    if isinstance(error, UnicodeError):
        return message("it is no text in UTF-8")
    if not isinstance(error, OSError) or error.errno is None or not error.strerror:
        return str(error)
    if isinstance(error.strerror, Message):
        return error.strerror  # raised by us, with a reason that says more
    if getattr(error, "winerror", None) in _SHARING:
        return _REASONS[errno.EBUSY]
    if (reason := _REASONS.get(error.errno)) is not None:
        return reason
    if error.errno in errno.errorcode:
        name = errno.errorcode[error.errno]
        return message("the system refused it, with error {number} ({name})", number=error.errno, name=name)
    return error.strerror  # a library's own number, such as that of a failed name look-up
