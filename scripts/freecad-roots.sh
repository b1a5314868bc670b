#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
#
# The FreeCADs that the tests run in: the machine's own, and those of other Debian releases, each in a
# root directory of its own below the user's cache.
#
#   scripts/freecad-roots.sh [build [SUITE…]]       build or complete roots (default: all that this machine lacks)
#   scripts/freecad-roots.sh --list                 name, version, Python, command, dependency folder
#   scripts/freecad-roots.sh run NAME COMMAND…      run a command of that root (freecadcmd, freecad …)
#   scripts/freecad-roots.sh remove NAME            delete a root
#
# A build can be stopped at any time and started again: it continues where it was. Mounts are made in a mount
# namespace of the running command only, so nothing stays mounted, however the command ends.
#
# SILO_FREECAD_ROOTS     where the roots are kept (default: the user's cache folder)
# SILO_DEBIAN_MIRROR     a Debian mirror; default: the one that this machine's apt uses
# Exit codes: 0 done, 1 failed, 2 wrong usage, 3 this machine cannot build or enter such roots.
set -euo pipefail

REPO=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
CACHE=${SILO_FREECAD_ROOTS:-${XDG_CACHE_HOME:-$HOME/.cache}/silo-mod/freecad}
SELF=$(realpath "${BASH_SOURCE[0]}")
# Debian releases and the FreeCAD that each has; together all that the add-on must work in.
SUITES=(bookworm trixie sid)
declare -A FREECAD_OF=([bookworm]=0.20 [trixie]=1.0 [sid]=1.1)
# Raise this when the recipe below changes: finished roots are then completed anew.
RECIPE=3
# The second line is what FreeCAD's window needs under Xvfb and what apt would only recommend.
PACKAGES=(freecad freecad-python3 ca-certificates
  libgl1-mesa-dri fonts-dejavu-core procps)
# What the add-on needs inside FreeCAD; package.xml declares the same.
DEPENDENCIES=(requests pydantic sseclient-py)
# Folders that belong to the machine's own system. Every other top folder (home, tmp, srv, …) is shown inside
# the root at the same place, so a path means the same file inside and outside.
SYSTEM_DIRS=" bin boot dev etc lib lib32 lib64 libx32 lost+found proc run sbin sys usr var "

say() { printf 'freecad-roots: %s\n' "$*" >&2; }
cannot() { say "cannot: $*"; exit 3; }

# --- what this machine can do ---------------------------------------------------------------------------

require_mounts() {
  [ "$(id -u)" = 0 ] || cannot "entering a root needs root rights (id is $(id -u))"
  unshare --mount --propagation private -- mount --bind / / 2>/dev/null ||
    cannot "this machine does not allow mount namespaces (a container without CAP_SYS_ADMIN?)"
}

debian_mirror() {
  if [ -n "${SILO_DEBIAN_MIRROR:-}" ]; then echo "$SILO_DEBIAN_MIRROR"; return; fi
  command -v apt-get >/dev/null || cannot "no apt here to ask for a mirror; set SILO_DEBIAN_MIRROR"
  local mirror
  mirror=$(apts_mirror)
  # Without package lists (a fresh image) apt does not know what its sources are.
  if [ -z "$mirror" ] && apt-get -qq update >&2; then mirror=$(apts_mirror); fi
  [ -n "$mirror" ] || cannot "apt knows no Debian mirror; set SILO_DEBIAN_MIRROR"
  echo "$mirror"
}

apts_mirror() {
  # shellcheck disable=SC2016  # apt expands these, not the shell
  apt-get indextargets --format '$(ORIGIN) $(COMPONENT) $(REPO_URI)' 'Created-By: Packages' 2>/dev/null |
    awk '$1 == "Debian" && $2 == "main" && $3 ~ /^(https?|file):/ && $3 !~ /security/ && !n++ { print $3 }'
}

use_apts_proxy() {
  local proxy=""
  eval "$(apt-config shell proxy Acquire::http::Proxy 2>/dev/null || true)"
  if [ -n "$proxy" ] && [ "$proxy" != DIRECT ]; then export http_proxy="$proxy" https_proxy="$proxy"; fi
}

# --- entering a root -------------------------------------------------------------------------------------

# in_root ROOT COMMAND…  Runs in a private mount namespace; the kernel drops the mounts with its last process.
in_root() {
  local root=$1; shift
  # shellcheck disable=SC2016  # expanded by the inner shell
  unshare --mount --propagation private -- bash -c '
    set -euo pipefail
    root=$1 system=$2 cwd=$3; shift 3
    mount -t proc proc "$root/proc"
    mount --rbind /dev "$root/dev"
    for dir in /*/; do
      name=$(basename "$dir")
      case "$system" in *" $name "*) continue ;; esac
      [ -L "/$name" ] && continue
      mkdir -p "$root/$name"
      mount --bind "/$name" "$root/$name"
    done
    exec chroot "$root" /bin/sh -c "cd \"\$0\" 2>/dev/null || cd /; exec \"\$@\"" "$cwd" "$@"
  ' in-root "$root" "$SYSTEM_DIRS" "$PWD" "$@"
}

run_in() {
  local name=$1; shift
  [ -e "$CACHE/$name/.silo-complete" ] || { say "no finished root '$name'; build it: $SELF build $name"; exit 1; }
  require_mounts
  # The profile of the machine's own FreeCAD must not be used by another version.
  if [ -z "${FREECAD_USER_HOME:-}" ]; then export FREECAD_USER_HOME="$CACHE/profiles/$name"; fi
  mkdir -p "$FREECAD_USER_HOME"
  export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8
  in_root "$CACHE/$name" "$@"
}

# --- building --------------------------------------------------------------------------------------------

bootstrap() {
  local suite=$1 root="$CACHE/$1" mirror=$2
  if [ -e "$root/.silo-bootstrapped" ]; then return; fi
  command -v debootstrap >/dev/null || cannot "debootstrap is not installed"
  say "$suite: bootstrapping from $mirror"
  # A half bootstrapped tree cannot be continued; the packages already loaded can be used again.
  rm -rf --one-file-system "$root"
  mkdir -p "$CACHE/debs/$suite"
  use_apts_proxy
  debootstrap --variant=minbase --cache-dir="$CACHE/debs/$suite" "$suite" "$root" "$mirror" ||
    { say "$suite: debootstrap failed, see $root/debootstrap/debootstrap.log"; return 1; }
  rm -rf "$CACHE/debs/$suite"
  touch "$root/.silo-bootstrapped"
}

configure_apt() {
  local root=$1
  # The machine's apt settings (proxy, certificates) hold in the root too; the names resolve as they do outside.
  mkdir -p "$root/etc/apt/apt.conf.d"
  cp -a /etc/apt/apt.conf.d/. "$root/etc/apt/apt.conf.d/" 2>/dev/null || true
  cp -L /etc/resolv.conf "$root/etc/resolv.conf" 2>/dev/null || true
  echo 'Acquire::Retries "3";' >"$root/etc/apt/apt.conf.d/80-retries"
  # No service is to be started in a root.
  printf '#!/bin/sh\nexit 101\n' >"$root/usr/sbin/policy-rc.d"
  chmod +x "$root/usr/sbin/policy-rc.d"
}

install_freecad() {
  local suite=$1 root="$CACHE/$1"
  say "$suite: installing FreeCAD"
  configure_apt "$root"
  export DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin
  in_root "$root" dpkg --configure -a
  in_root "$root" apt-get -q update
  in_root "$root" apt-get -q -y -f --no-install-recommends install "${PACKAGES[@]}"
  # Qt 6 reads SVG with a plugin: without it the check marks of FreeCAD's themes are not drawn.
  if in_root "$root" dpkg -s libqt6svg6 >/dev/null 2>&1; then
    in_root "$root" apt-get -q -y --no-install-recommends install qt6-svg-plugins
  fi
  in_root "$root" apt-get clean
}

# python_of COMMAND…  and  version_of COMMAND…: asked from FreeCAD itself, behind a marker line.
ask_freecad() {
  "$@" -c 'import FreeCAD, sys; v = FreeCAD.Version()
sys.stdout.write("\nSILO %s.%s %d.%d\n" % (v[0], v[1] if "." in v[1] else v[1] + "." + v[2].split(" ")[0].split("-")[0], *sys.version_info[:2]))
sys.stdout.flush()' </dev/null 2>/dev/null | awk '$1 == "SILO" { print $2, $3 }'
}

install_dependencies() {
  local python=$1 target="$CACHE/deps/py${1//./}"
  # The folder says what it was completed with: other dependencies complete it anew.
  [ "$(cat "$target/.silo-complete" 2>/dev/null)" = "${DEPENDENCIES[*]}" ] && return
  local pip=("$REPO/.venv/bin/python" -m pip)
  [ -x "${pip[0]}" ] || pip=(python3 -m pip)
  say "Python $python: installing ${DEPENDENCIES[*]}"
  mkdir -p "$target"
  "${pip[@]}" -q install --upgrade --target "$target" --python-version "$python" --implementation cp \
    --only-binary=:all: "${DEPENDENCIES[@]}" ||
    { say "Python $python: pip could not load ${DEPENDENCIES[*]}; GUI tests for it will skip"; return 0; }
  echo "${DEPENDENCIES[*]}" >"$target/.silo-complete"
}

write_wrappers() {
  local name=$1 command enter="$CACHE/bin/freecad-roots.sh"
  mkdir -p "$CACHE/bin/$name"
  # The roots outlive the checkout that made them, and so must the way into them.
  cp "$SELF" "$enter.$$"
  mv "$enter.$$" "$enter"
  for command in freecadcmd freecad; do
    printf '#!/bin/sh\nSILO_FREECAD_ROOTS="%s" exec "%s" run "%s" %s "$@"\n' \
      "$CACHE" "$enter" "$name" "$command" >"$CACHE/bin/$name/$command"
    chmod +x "$CACHE/bin/$name/$command"
  done
}

build_one() {
  local suite=$1 root="$CACHE/$1" mirror
  mkdir -p "$CACHE"
  exec 8>"$CACHE/$suite.lock"
  flock 8
  write_wrappers "$suite"
  if [ "$(cut -d' ' -f1 "$root/.silo-complete" 2>/dev/null)" != "$RECIPE" ]; then
    require_mounts
    mirror=$(debian_mirror)
    bootstrap "$suite" "$mirror"
    install_freecad "$suite"
    mkdir -p "$CACHE/profiles/$suite"
    local answer
    answer=$(export FREECAD_USER_HOME="$CACHE/profiles/$suite" && ask_freecad in_root "$root" freecadcmd)
    [ -n "$answer" ] || { say "$suite: freecadcmd does not start"; return 1; }
    case "$answer" in "${FREECAD_OF[$suite]:-}"*) ;; *) say "$suite has FreeCAD ${answer% *} now" ;; esac
    echo "$RECIPE $answer" >"$root/.silo-complete"
  fi
  install_dependencies "$(cut -d' ' -f3 "$root/.silo-complete")"
  echo "$CACHE/bin/$suite/freecadcmd"
}

own_freecad() { command -v freecadcmd || command -v FreeCADCmd || true; }

own_answer() {
  local command home
  command=$(own_freecad)
  if [ -z "$command" ]; then return; fi
  # Each FreeCAD writes its profile when it ends; several that are asked at once must not share one.
  home=$(mktemp -d)
  FREECAD_USER_HOME=$home ask_freecad "$command" || true
  rm -rf "$home"
}

build() {
  local suite answer failed=0
  answer=$(own_answer)
  if [ -n "$answer" ]; then install_dependencies "${answer#* }"; fi
  if [ $# = 0 ]; then
    for suite in "${SUITES[@]}"; do
      case "$answer" in "${FREECAD_OF[$suite]}".*) ;; *) set -- "$@" "$suite" ;; esac
    done
  fi
  for suite in "$@"; do
    local rc=0
    # A process of its own: "set -e" would not hold in a function whose result is looked at.
    "$SELF" build-one "$suite" || rc=$?
    if [ "$rc" != 0 ]; then failed=$rc; say "$suite: not built"; fi
  done
  return "$failed"
}

# --- listing ---------------------------------------------------------------------------------------------

line() { printf '%s\t%s\t%s\t%s\t%s\n' "$1" "$2" "$3" "$4" "$CACHE/deps/py${3//./}"; }

list() {
  local answer suite complete
  answer=$(own_answer)
  if [ -n "$answer" ]; then line own "${answer% *}" "${answer#* }" "$(own_freecad)"; fi
  for suite in "${SUITES[@]}"; do
    complete="$CACHE/$suite/.silo-complete"
    if [ -e "$complete" ]; then
      line "$suite" "$(cut -d' ' -f2 "$complete")" "$(cut -d' ' -f3 "$complete")" "$CACHE/bin/$suite/freecadcmd"
    fi
  done
}

case "${1:-build}" in
  build) if [ $# -gt 0 ]; then shift; fi; build "$@" ;;
  build-one) build_one "$2" ;;
  list | --list) list ;;
  run) shift; [ $# -ge 2 ] || { say "run NAME COMMAND…"; exit 2; }; run_in "$@" ;;
  remove) shift; [ -n "${FREECAD_OF[${1:-none}]:-}" ] || { say "remove one of: ${SUITES[*]}"; exit 2; }
    rm -rf --one-file-system "${CACHE:?}/$1" "${CACHE:?}/bin/$1" "${CACHE:?}/profiles/$1" ;;
  *) sed -n '3,/^set/p' "$SELF" | sed -n 's/^# \{0,1\}//p'; exit 2 ;;
esac
