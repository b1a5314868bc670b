# SPDX-License-Identifier: LGPL-2.1-or-later
"""Tables that companies bring (CSV, XLSX, ODS, XLS): bytes → rows whose columns have a meaning, or a refusal.

The one reader of the project: for masses, registration and all imports. Its questions and their modules:

* which kind of table, with which columns: ``kind``; which column has which role: ``columns``, and what a
  heading says beside that (a currency, "per 100", a unit): ``heading_detail``;
* encoding and separator: ``csv_text``; heading rows, merged cells, rows that are too long: ``sheet``;
* the decimal mark of a column: ``numerals``; yes and no: ``yes_no``; sums below a table: ``totals``;
* which row stands below which: ``structure``;
* the rows of a BOM, of a price list and of a list of parts: ``bom_rows``, ``price_rows``, ``part_rows``.

Each column is used or named as unused. A text with two readings is a problem of its row, never a guess.
"""
