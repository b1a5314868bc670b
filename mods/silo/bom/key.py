# SPDX-License-Identifier: LGPL-2.1-or-later
"""The key of a component: (file, object), or the designation of a standard part."""

Key = tuple[str, str]
