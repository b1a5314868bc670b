# SPDX-License-Identifier: LGPL-2.1-or-later
"""What differs between Windows, macOS and Linux, asked here and nowhere else. Standard library only.

Where a difference shows in what Python offers (a module, a constant, an error's number), that is asked
instead of the platform's name, so that tests can put either in its place.
"""
