#!/usr/bin/env bash
# Makes a root of Debian 12 for 64-bit Arm with the locked packages, for `make portable`.
# usage: tests/portable/make_arm_root.sh [FOLDER]     (default: ~/.cache/flight_graph/arm_root; some 1.4 GB)
# Needs debootstrap, dpkg-deb and qemu-aarch64-static; neither chroot nor binfmt.
# MIRROR names another mirror of Debian, PYTHON whose pip installs (default: that of .venv).
set -euo pipefail
root=${1:-${XDG_CACHE_HOME:-$HOME/.cache}/flight_graph/arm_root}
source=$(cd "$(dirname "$0")/../.." && pwd)

stop() { echo "make_arm_root: $*" >&2; exit 1; }
for tool in debootstrap dpkg-deb; do
    command -v "$tool" >/dev/null || PATH=$PATH:/usr/sbin command -v "$tool" >/dev/null || stop "$tool is not there"
done
PATH=$PATH:/usr/sbin
qemu=$(command -v qemu-aarch64-static || command -v qemu-aarch64) || stop "qemu-aarch64-static is not there"
[ ! -e "$root/usr/bin/python3.11" ] || stop "$root is there already; remove it to make it anew"
python=${PYTHON:-$source/.venv/bin/python}
[ -x "$python" ] || stop "run make setup first, or name a Python with pip: PYTHON=/path/to/python3"
as_root=()
[ "$(id -u)" = 0 ] || { command -v fakeroot >/dev/null || stop "neither root nor fakeroot"; as_root=(fakeroot); }

mkdir -p "$root"
root=$(cd "$root" && pwd)
"${as_root[@]}" debootstrap --arch=arm64 --foreign --variant=minbase --include=python3 bookworm "$root" \
    "${MIRROR:-http://deb.debian.org/debian}"
for package in "$root"/var/cache/apt/archives/*.deb; do # in place of the second stage, which would run on Arm
    dpkg-deb -x "$package" "$root"
done
rm -f "$root"/var/cache/apt/archives/*.deb

# A Python that the host can start, and that starts itself again as the compiler's processes.
cat > "$root/usr/bin/arm_python" <<SCRIPT
#!/bin/sh
root=\$(cd "\$(dirname "\$0")/../.." && pwd)
QEMU_LD_PREFIX=\$root exec "$qemu" -0 "\$root/usr/bin/arm_python" "\$root/usr/bin/python3.11" "\$@"
SCRIPT
chmod +x "$root/usr/bin/arm_python"

# pip of this project's environment, run by the Arm Python: so the wheels and the markers are those of that machine.
pip=$("$python" -c 'import pip; print(pip.__path__[0])')
"$root/usr/bin/arm_python" "$pip" --disable-pip-version-check install --quiet --no-deps \
    --require-hashes --only-binary :all: --no-compile --root-user-action ignore \
    --target "$root/usr/local/lib/python3.11/dist-packages" -r "$source/requirements/python3.11-test.txt"
echo "make_arm_root: $root is ready (make portable ARM_ROOT=$root)"
