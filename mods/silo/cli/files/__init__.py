# SPDX-License-Identifier: LGPL-2.1-or-later
"""The commands that read files of this machine."""
