#!/usr/bin/env bash
# Make or refresh one virtual environment of this checkout:
#
#   tools/setup_env.sh .venv demo           enough to run Demsmith, beside QGIS and GDAL
#   tools/setup_env.sh .venv test           that, and the tools of `make test`
#   tools/setup_env.sh .venv-numpy2 numpy2  the library on the newest NumPy, arrays only
#
# The first two install QGIS and GDAL by apt where they are missing and root or sudo is at hand,
# and use /usr/bin/python3, the only Python that sees them. Where QGIS cannot be had they make an
# environment for arrays, and say so. Done, it leaves ENV/KIND.stamp; not while QGIS is missing.
# What apt and pip say goes to build/setup.log, and is shown when they fail.
set -euo pipefail
cd "$(dirname "$0")/.."
unset PYTHONHOME PYTHONPATH
export PYTHONNOUSERSITE=1 PIP_USER=0 PIP_DISABLE_PIP_VERSION_CHECK=1 LC_ALL=C.UTF-8

readonly venv=$1 kind=$2
readonly system_python=/usr/bin/python3
readonly log=build/setup.log
readonly apt_packages=(python3-venv qgis python3-qgis qgis-providers gdal-bin python3-gdal)

main() {
    mkdir -p build
    echo "# tools/setup_env.sh $venv $kind, $(date)" >>"$log"
    case $kind in
        demo | test) set_up_beside_qgis ;;
        numpy2) set_up_apart ;;
        *) die "unknown kind of environment: $kind (demo, test or numpy2)" ;;
    esac
}

set_up_beside_qgis() {
    if ! sees_qgis; then
        install_qgis
    fi
    local python constraint=()
    if sees_gdal; then
        make_venv --system-site-packages "$system_python"
        if system_says 'import numpy, sys; sys.exit(not numpy.__version__.startswith("1."))'; then
            constraint=(-c constraints-qgis.txt) # QGIS and GDAL here are built for NumPy 1
        fi
    else
        python=$(any_python)
        make_venv "" "$python"
    fi
    say "Python packages into $venv by pip (a minute or two the first time; log: $log)"
    logged "$venv/bin/python" -m pip install "${constraint[@]}" -e ".[$kind]" ||
        die "pip could not install the packages"
    if sees_qgis; then
        say "$venv is ready: $("$venv/bin/python" -V), $(qgis_version)"
        touch "$venv/demo.stamp" "$venv/$kind.stamp" # test holds all of demo
    else
        say "$venv is ready for arrays: $("$venv/bin/python" -V)"
        say "left out: QGIS$(sees_gdal || echo ' and GDAL (no rasters are read or written)'). To have" \
            "it, let an administrator run:"
        say "  apt-get install --no-install-recommends ${apt_packages[*]}"
    fi
}

set_up_apart() {
    local python
    python=$(any_python)
    make_venv "" "$python"
    say "the newest NumPy into $venv by pip (half a minute the first time; log: $log)"
    logged "$venv/bin/python" -m pip install --upgrade --upgrade-strategy eager -e . ||
        die "pip could not install the packages"
    touch "$venv/$kind.stamp"
}

# --- what this machine has ---------------------------------------------------------------------

system_says() { [[ -x $system_python ]] && "$system_python" -s -c "$1" 2>>"$log"; }

new_enough() { "$1" -s -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>>"$log"; }

makes_venvs() { "$1" -s -c 'import ensurepip, venv; ensurepip.version()' 2>>"$log"; }

sees_gdal() { usable_system_python && system_says 'from osgeo import gdal'; }

sees_qgis() {
    sees_gdal && system_says 'import qgis.core' &&
        { command -v qgis_process || command -v qgis_process.bin; } >>"$log"
}

usable_system_python() {
    [[ -x $system_python ]] && new_enough "$system_python" && makes_venvs "$system_python"
}

qgis_version() { system_says 'from qgis.core import Qgis; print("QGIS", Qgis.QGIS_VERSION)'; }

any_python() {
    local candidate
    for candidate in "$system_python" python3.14 python3.13 python3.12 python3.11 python3; do
        if command -v "$candidate" >>"$log" && new_enough "$candidate" && makes_venvs "$candidate"
        then
            echo "$candidate"
            return
        fi
    done
    die "no Python of 3.11 or newer that can make virtual environments was found. On Debian 12+ or" \
        "Ubuntu 24.04+ let an administrator run: apt-get install python3-venv"
}

# --- getting what it lacks ---------------------------------------------------------------------

install_qgis() {
    local as_root
    if [[ -x $system_python ]] && ! new_enough "$system_python"; then
        say "$system_python is $("$system_python" -V); Demsmith needs 3.11 or newer, so the QGIS of" \
            "this system cannot be used (Debian 12+ and Ubuntu 24.04+ have a newer one)"
        return
    fi
    if ! command -v apt-get >>"$log"; then
        say "no apt-get on this system: QGIS is not installed"
        return
    fi
    if ! as_root=$(root_command); then
        say "neither root nor sudo: QGIS and GDAL cannot be installed"
        return
    fi
    say "QGIS and GDAL by apt (two or three minutes the first time; log: $log)"
    if ! { logged $as_root apt-get update && logged $as_root env DEBIAN_FRONTEND=noninteractive \
        apt-get -o DPkg::Lock::Timeout=300 install -y --no-install-recommends \
        "${apt_packages[@]}"; }; then
        say "apt could not install QGIS and GDAL; going on without"
    fi
}

# Prints the prefix that runs a command as root. Asks for a password only at a terminal, and only
# before the environment exists: whoever said no once is not asked at every later `make`.
root_command() {
    if [[ $(id -u) == 0 ]]; then
        echo ""
    elif ! command -v sudo >>"$log"; then
        return 1
    elif sudo -n true 2>>"$log" || { [[ -t 0 && ! -d $venv ]] && sudo -v; }; then
        echo sudo
    else
        return 1
    fi
}

# make_venv OPTION PYTHON: keeps an environment that already is of this kind and works.
make_venv() {
    local option=$1 python=$2 shared=false
    [[ $option == --system-site-packages ]] && shared=true
    if "$venv/bin/python" -m pip --version >>"$log" 2>&1 &&
        grep -q "include-system-site-packages = $shared" "$venv/pyvenv.cfg" &&
        new_enough "$venv/bin/python" && belongs_here; then
        return
    fi
    say "virtual environment $venv from $python"
    logged "$python" -m venv --clear ${option:+"$option"} "$venv" ||
        die "$python could not make the virtual environment"
}

# Whether it was made in this place: the scripts of one that was moved or copied start another.
belongs_here() { [[ $(grep '^command' "$venv/pyvenv.cfg") == *" $(pwd -P)/$venv" ]]; }

# --- talking -----------------------------------------------------------------------------------

say() { echo "==> $*"; }

logged() {
    echo "\$ $*" >>"$log"
    local first
    first=$(wc -l <"$log")
    "$@" >>"$log" 2>&1 </dev/null || {
        local status=$?
        echo "--- $* failed; the end of what it said (all of it in $log):" >&2
        tail -n "+$((first + 1))" "$log" | tail -n 30 >&2
        return $status
    }
}

die() {
    echo "==> set-up stopped: $*" >&2
    exit 1
}

main
