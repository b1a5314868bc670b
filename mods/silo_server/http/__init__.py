# SPDX-License-Identifier: LGPL-2.1-or-later
"""What stands around every route: request ids and the log, errors, limits, strict headers, compression."""
