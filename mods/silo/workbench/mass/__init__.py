# SPDX-License-Identifier: LGPL-2.1-or-later
"""Masses and inertias of the open assembly."""
