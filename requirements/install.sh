#!/usr/bin/env bash
# Fills .venv with the pinned, hash-checked packages of requirements/; `make setup` calls it.
# usage: requirements/install.sh [python]     (ROS=none in the environment leaves ROS 2 out)
#        requirements/install.sh --tests      adds the packages of the tests to it (PINOCCHIO=none leaves Pinocchio out,
#                                             RERUN=none the viewer Rerun)
#        requirements/install.sh --viewers    adds the packages of flight view and flight serve to it
#        requirements/install.sh --docs       adds the packages of the handbook's site and of its notebooks to it
set -euo pipefail
cd "$(dirname "$0")/.."
venv=.venv
case "$(uname -s)" in
    MINGW* | MSYS* | CYGWIN*) bin=$venv/Scripts ;;
    *) bin=$venv/bin ;;
esac

stop() { echo "setup: $*" >&2; exit 1; }
is_supported() {
    "$1" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info[:2] not in ((3, 11), (3, 12)))' >/dev/null 2>&1
}
has_ros_wheels() { # manylinux_2_28_x86_64
    "$python" -c 'import platform, sys
libc, version = platform.libc_ver()
here = sys.platform, platform.machine(), libc
sys.exit(here != ("linux", "x86_64", "glibc") or tuple(map(int, version.split(".")[:2])) < (2, 28))'
}
has_ros() { "$1" -c 'import rclpy' >/dev/null 2>&1; }
version_of() { "$1" -c 'import sys; print("%d.%d" % sys.version_info[:2], end="")'; }

if [ "${ROS_DISTRO:-jazzy}" != jazzy ]; then
    stop "ROS 2 $ROS_DISTRO is sourced, this project runs on Jazzy: use a shell in which it is not sourced."
fi

pip() { $bin/python -m pip --disable-pip-version-check "$@"; }
locked() { pip install --quiet --require-hashes --only-binary :all: -r "$1"; }
if [ "${1:-}" = --viewers ]; then
    locked "requirements/python$(version_of $bin/python)-view.txt"
    echo "setup: packages of flight view and flight serve"
    exit
fi
if [ "${1:-}" = --docs ]; then
    locked "requirements/python$(version_of $bin/python)-docs.txt" || stop "the packages of the handbook's site could not be" \
        "installed (the reason stands above; it needs a package index). docs/*.md can be read without it."
    echo "setup: packages of the handbook and its notebooks"
    exit
fi
if [ "${1:-}" = --tests ]; then
    lock=requirements/python$(version_of $bin/python)
    locked "$lock-test.txt"
    if [ "${PINOCCHIO:-}" = none ]; then
        echo "setup: packages of the tests, without Pinocchio: what it judges is skipped"
    else
        locked "$lock-pinocchio.txt"
        echo "setup: packages of the tests"
    fi
    if [ "${RERUN:-}" = none ]; then
        echo "setup: without Rerun: what it reads back is skipped"
    elif ! locked "$lock-view.txt"; then
        echo "setup: Rerun cannot be installed here: what it reads back is skipped"
    fi
    exit
fi

python=${1:-}
if [ -n "$python" ]; then
    is_supported "$python" || stop "PYTHON=$python is not a Python 3.11 or 3.12 with the modules venv and ensurepip."
elif [ "${ROS_DISTRO:-}" = jazzy ] && is_supported python3 && has_ros python3; then
    python=python3 # the one that the sourced ROS 2 is built for
else
    for candidate in $bin/python python3.12 python3.11 python3 python; do
        if is_supported "$candidate"; then python=$candidate; break; fi
    done
    [ -n "$python" ] || stop "no Python 3.11 or 3.12 with the modules venv and ensurepip was found (on Debian and" \
        "Ubuntu: apt install python3-venv). Install one, or name one: make setup PYTHON=/path/to/python3.12"
fi
python=$("$python" -c 'import sys; print(sys._base_executable, end="")') # not a venv's own, which may be remade below
version=$(version_of "$python")

lock=requirements/python$version.txt
inherit=false # whether the environment sees the system's packages
if [ "${ROS:-}" = none ]; then
    ros="none, as asked"
elif [ "${ROS_DISTRO:-}" = jazzy ] && has_ros "$python"; then
    ros="the sourced Jazzy"
    inherit=true
elif has_ros_wheels; then
    ros="Jazzy from wheels"
    lock=requirements/python$version-ros.txt
else
    ros="none (its wheels are for x86_64 Linux with glibc 2.28 or newer, and no Jazzy is sourced); all but the ROS executor works"
fi
echo "setup: Python $version; ROS 2: $ros; packages of $lock"

is_as_wanted() {
    [ "$(version_of $bin/python 2>/dev/null)" = "$version" ] &&
        grep -q "^include-system-site-packages = $inherit" $venv/pyvenv.cfg
}
if ! is_as_wanted; then
    options=(--clear)
    [ $inherit = false ] || options+=(--system-site-packages)
    "$python" -m venv "${options[@]}" $venv
    echo "setup: fetching the packages, 1 GB in $venv; this takes minutes, once"
fi

pip install --quiet --require-hashes --only-binary :all: -r requirements/build.txt
# empy comes as source only; the build tools just installed build it, so that no unpinned ones are fetched.
pip install --quiet --require-hashes --no-build-isolation --only-binary :all: --no-binary empy -r "$lock"
