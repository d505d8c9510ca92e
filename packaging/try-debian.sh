#!/usr/bin/env bash
# Installs a Debian package in a fresh Debian and flies there. Needs root and debootstrap.
#
#   packaging/try-debian.sh target/debian/ringwing_0.1.0-1_amd64.deb
set -euo pipefail
package=$(realpath "$1")
cd "$(dirname "$0")/.."

root=$(mktemp -d /tmp/ringwing-debian.XXXXXX)
leave() {
  for place in dev/shm proc; do
    mountpoint -q "$root/$place" && umount "$root/$place"
  done
  rm -rf --one-file-system "$root"
}
trap leave EXIT

debootstrap --variant=minbase bookworm "$root"
# A shared memory of its own: nothing that this test leaves there can be taken for a run of the host.
mount -t proc proc "$root/proc"
mkdir -p "$root/dev/shm"
mount -t tmpfs -o size=256m tmpfs "$root/dev/shm"
cp "$package" "$root/tmp/ringwing.deb"

inside() { chroot "$root" /usr/bin/env -i PATH=/usr/bin:/bin:/usr/sbin:/sbin HOME=/root "$@"; }
inside apt-get install --yes --no-install-recommends /tmp/ringwing.deb
inside ringwing --version
inside ringwing doctor
inside sh -c 'cd /tmp && ringwing run dropout && ringwing verify latest'
inside test -e /usr/share/man/man1/ringwing-run.1.gz
inside test -e /usr/share/bash-completion/completions/ringwing
# A controller in C, the one of the manual, built here: the fresh Debian has no compiler.
sed -n '/^```c$/,/^```$/p' docs/src/controllers.md | sed '/^```/d' >"$root/tmp/straight.c"
cc "$root/tmp/straight.c" -o "$root/tmp/straight" -I "$root/usr/include" -L "$root/usr/lib" -lringwing
# It flies straight on and never reaches its slot, so the flight violates its requirements, which is exit code 3. Its process has to stay.
inside sh -c 'cd /tmp && ringwing run paper-4.1 --duration 5 --json --agent "3=./straight" >straight.json; [ $? = 3 ]'
inside grep -q '"unplanned_losses": 0' /tmp/straight.json
inside test -e /usr/lib/pkgconfig/ringwing.pc
inside apt-get remove --yes ringwing
if inside test -e /usr/bin/ringwing; then
  echo "the package leaves /usr/bin/ringwing behind"
  exit 1
fi
