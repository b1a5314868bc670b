# SPDX-License-Identifier: LGPL-2.1-or-later
"""A commit: what is saved, asked and handed over."""
