#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
#
# What the geometry kernel's package needs of the system and does not bring itself: OpenGL's library, which a
# desktop has and a bare server has not. As root on Debian or Ubuntu it is installed; else this says how.
#
#   scripts/kernel-libraries.sh PYTHON
set -uo pipefail

loads() { "$1" -c 'import OCP.BRep' 2>/dev/null; }

loads "$1" && exit 0
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "The geometry kernel needs libGL.so.1: installing libgl1" >&2
    export DEBIAN_FRONTEND=noninteractive
    apt="apt-get -qq -o Acquire::Retries=3"
    $apt update && $apt install -y --no-install-recommends libgl1 >/dev/null
fi
loads "$1" && exit 0
echo "The geometry kernel cannot be loaded; tests that need it are skipped." >&2
"$1" -c 'import OCP.BRep' 2>&1 | tail -1 >&2
echo "On Debian and Ubuntu: apt-get install libgl1" >&2
