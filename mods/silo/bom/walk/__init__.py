# SPDX-License-Identifier: LGPL-2.1-or-later
"""The parts of the walker: what an object is, where a link leads, what one assembly holds, what to report.

:mod:`silo.bom.links` puts them together; nobody else needs them but readers of documents.
"""
