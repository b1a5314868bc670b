# SPDX-License-Identifier: LGPL-2.1-or-later
"""The border to Qt, and the widgets that windows share."""
