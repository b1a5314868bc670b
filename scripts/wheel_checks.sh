#!/usr/bin/env bash
# The wheel with the lowest versions that pyproject.toml declares, outside of the checkout: the demo, the robot example
# and, where there is a FreeCAD, the add-on. Fails where a declared lower bound is not true.
set -euo pipefail
cd "$(dirname "$0")/.."
python=${1:-python3}
work=$(mktemp -d)
trap 'rm -rf "$work" build' EXIT

"$python" -m venv "$work/env"
bin=$work/env/bin
[ -d "$bin" ] || bin=$work/env/Scripts  # Windows
pip=("$bin/python" -m pip --quiet --disable-pip-version-check)
"${pip[@]}" wheel --no-deps --wheel-dir "$work" .
"$bin/python" - >"$work/lowest.txt" <<'PY'
import re, tomllib
project = tomllib.load(open("pyproject.toml", "rb"))["project"]
extras = project["optional-dependencies"]
for line in (*project["dependencies"], *extras["server"], *extras["inertia"]):
    name, bound = re.match(r"([\w.-]+)(?:\[[^]]*\])?>=([\w.]+)", line).groups()
    print(f"{name}=={bound}")
PY
# Old releases have no wheels for a newer Python; there the newest versions are tried.
"$bin/python" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || : >"$work/lowest.txt"
"${pip[@]}" install --constraint "$work/lowest.txt" "$(echo "$work"/*.whl)[server,inertia]"

cp -r examples/arm "$work/arm"
cd "$work"
export SILO_HOME="$work/home"
silo_mod="$bin/silo-mod"
echo "demo"
"$silo_mod" demo >demo.txt
grep -q "Database Activity" demo.txt
echo "inertia"
"$silo_mod" inertia arm/arm.step --bom arm/bom.csv --json >inertia.json
grep -q '"mass"' inertia.json
if command -v "${SILO_FREECADCMD:-freecadcmd}" >/dev/null; then
    echo "install-addon"
    "$silo_mod" install-addon --freecad-data "$work/freecad" >addon.txt
    test -f "$work/freecad/Mod/Silo/mods/silo/workbench/start.py"
fi
echo "The wheel works with: $("$bin/python" -m pip freeze | tr '\n' ' ')"
