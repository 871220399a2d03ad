#!/usr/bin/env bash
# Try the README's two commands on a fresh Debian 12: `make fresh`. Needs root, debootstrap and some ten minutes.
#
# A minimal system in a scratch folder gets the README's apt line and nothing else. An ordinary user with an empty
# environment then runs `make demo` and `make test` in a clone of the last commit. Before that pip says whether every pinned
# version exists for the oldest supported interpreters. Of this machine only the name server, the certificates and the
# settings of pip and apt are copied, so that a network with a proxy or a mirror works.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
[ "$(id -u)" = 0 ] && command -v debootstrap >/dev/null || {
  echo "make fresh: needs root and debootstrap (apt-get install debootstrap)" >&2
  exit 2
}

python3 - <<'PYTHON' # pins that exist for one interpreter only
import subprocess, sys, tempfile

failed = []
for version in ("3.11.2", "3.12.3", "3.13.0"):
    with tempfile.TemporaryDirectory() as folder:
        command = [".venv/bin/python", "-m", "pip", "install", "--quiet", "--dry-run", "--no-deps", "--ignore-installed"]
        command += ["--only-binary=:all:", "--no-binary=empy", "--no-build-isolation", "--target", folder]  # empy: sources only
        done = subprocess.run([*command, "--python-version", version, "--requirement", "constraints.txt"])
    print(f"pins for Python {version}: {'found' if done.returncode == 0 else 'MISSING'}", flush=True)
    failed += [version] if done.returncode else []
sys.exit(bool(failed))
PYTHON

top=$(mktemp -d "${TMPDIR:-/var/tmp}/fresh-machine.XXXXXX")
system=$top/debian
finish() {
  mountpoint -q "$system/proc" && umount "$system/proc"
  mountpoint -q "$system/dev/shm" && umount "$system/dev/shm"
  rm -rf --one-file-system "$top"
}
trap finish EXIT
debootstrap --variant=minbase bookworm "$system" >"$top/debootstrap.log" || { tail "$top/debootstrap.log"; exit 1; }
mount -t proc proc "$system/proc"
mkdir -p "$system/dev/shm"
mount -t tmpfs tmpfs "$system/dev/shm"
copy_settings() {
  for file in "$@"; do
    [ -e "$file" ] && mkdir -p "$system${file%/*}" && cp -rL "$file" "$system${file%/*}/"
  done
}
copy_settings /etc/resolv.conf /etc/hosts /etc/pip.conf /etc/apt/apt.conf.d

line=$(sed -n 's/^sudo \(apt install .*\)/\1/p' README.md | head -n 1)
echo "a fresh Debian 12: $line"
chroot "$system" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive \
  sh -c "apt-get -qq update && apt-get -qq -y ${line#apt } >/dev/null"
copy_settings /etc/ssl/certs/ca-certificates.crt # after apt, which makes its own
chroot "$system" useradd --create-home --shell /bin/bash user
git clone --quiet --no-hardlinks . "$system/home/user/bouncing_disk_ros"
chroot "$system" chown -R user: /home/user
for command in "make demo" "make test"; do
  began=$SECONDS
  chroot "$system" su user -c "cd && env -i HOME=/home/user PATH=/usr/bin:/bin sh -c 'cd bouncing_disk_ros && $command'"
  echo "fresh Debian 12, $(chroot "$system" python3 --version): $command passed in $((SECONDS - began)) s"
done
