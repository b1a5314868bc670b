# SPDX-License-Identifier: LGPL-2.1-or-later
"""Registering components: what is offered, what the user requests, what is carried out."""
