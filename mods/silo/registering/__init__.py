# SPDX-License-Identifier: LGPL-2.1-or-later
"""Registering components: what is offered, what a person edits, what is carried out."""
