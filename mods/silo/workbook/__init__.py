# SPDX-License-Identifier: LGPL-2.1-or-later
"""XLSX, ODS and XLS workbooks: what each cell says and how a program shows it."""
