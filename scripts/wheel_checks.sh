#!/usr/bin/env bash
# wheel_checks.sh [PYTHON [lowest|newest]]: the source archive, the wheel that is built from it, and what a user does with
# it, outside of the checkout and without root: README's commands in their order, the demo, the robot example and, if there
# is a FreeCAD, the add-on. "lowest" takes the lowest versions that pyproject.toml declares; one that is not true fails.
set -euo pipefail
cd "$(dirname "$0")/.."
here=$PWD
python=${1:-python3}
work=$(mktemp -d)
trap 'rm -rf "$work" build' EXIT
[ -z "${DIST:-}" ] || DIST=$(realpath "$DIST")

"$python" -m venv "$work/env"
bin=$work/env/bin
[ -d "$bin" ] || bin=$work/env/Scripts # Windows
pip=("$bin/python" -m pip --quiet --disable-pip-version-check)
"$bin/python" -m venv "$work/builder"
builder=$work/builder/${bin##*/}/python
"$builder" -m pip --quiet --disable-pip-version-check install build
dist=${DIST:-$work/dist} # where the release wants what is built
"$builder" -m build --outdir "$dist" . >"$work/build.txt" 2>&1 || { tail -30 "$work/build.txt" && exit 1; }
"$bin/python" scripts/release.py contents "$dist"/*.whl
"$bin/python" - >"$work/lowest.txt" <<'PY'
import re, tomllib
project = tomllib.load(open("pyproject.toml", "rb"))["project"]
extras = project["optional-dependencies"]
for line in (*project["dependencies"], *extras["server"], *extras["inertia"]):
    name, bound = re.match(r"([\w.-]+)(?:\[[^]]*\])?>=([\w.]+)", line).groups()
    print(f"{name}=={bound}")
PY
# Old releases have no wheels for a newer Python.
which=${2:-$("$bin/python" -c 'import sys; print("lowest" if sys.version_info[:2] == (3, 11) else "newest")')}
[ "$which" = lowest ] || : >"$work/lowest.txt"
"${pip[@]}" install --constraint "$work/lowest.txt" "$(echo "$dist"/*.whl)[server,inertia]"

mkdir "$work/scripts"
cp -r README.md examples "$work"
cp scripts/page_commands.py "$work/scripts"
cd "$work"
export SILO_HOME="$work/home"
user=(env HOME="$work/home" TMPDIR="$work/tmp")
mkdir "$work/home" "$work/tmp"
if [ "$(id -u)" = 0 ] && command -v setpriv >/dev/null; then
    chmod 755 "$work"
    chown -R nobody "$work/home" "$work/tmp"
    nobody=(setpriv --reuid=nobody --regid=nogroup --clear-groups)
    # A Python below root's home is root's alone.
    ! "${nobody[@]}" env "$bin/python" -V >/dev/null 2>&1 || user=("${nobody[@]}" "${user[@]}")
fi
silo_mod="$bin/silo-mod"
echo "README's commands"
"${user[@]}" "$bin/python" scripts/page_commands.py README.md
echo "demo"
"${user[@]}" "$silo_mod" demo >demo.txt
grep -q "Database Activity" demo.txt
echo "inertia"
(cd "$here" && scripts/kernel-libraries.sh "$bin/python")
"${user[@]}" "$silo_mod" inertia examples/arm/arm.step --bom examples/arm/bom.csv --json >inertia.json
grep -q '"mass"' inertia.json
if command -v "${SILO_FREECADCMD:-freecadcmd}" >/dev/null; then
    echo "install-addon"
    "${user[@]}" "$silo_mod" install-addon --freecad-data "$SILO_HOME/freecad" >addon.txt
    test -f "$SILO_HOME/freecad/Mod/silo-mod/mods/silo/workbench/start.py"
fi
echo "The wheel works with the $which versions, as $("${user[@]}" id -un), in $("$bin/python" -V): $("$bin/python" -m pip freeze | tr '\n' ' ')"
[ -z "${DIST:-}" ] || {
    "$builder" -m pip --quiet --disable-pip-version-check install cyclonedx-bom
    "${builder%/python}/cyclonedx-py" environment --output-file "$DIST/silo-mod.cdx.json" "$bin/python"
    (cd "$DIST" && sha256sum silo* >SHA256SUMS)
}
