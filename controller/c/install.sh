#!/bin/sh
# Builds the library for controllers in C and C++ and installs it below PREFIX:
#
#   controller/c/install.sh PREFIX [BUILT]
#
# With BUILT, takes the libraries from that folder and builds nothing. Installs the header, the shared and the static library, and files
# for pkg-config and CMake. All of them find each other by their place, so PREFIX can be moved.
set -eu
if [ $# -lt 1 ] || [ $# -gt 2 ]; then
  echo "usage: $0 PREFIX [BUILT]" >&2
  exit 2
fi
here=$(cd "$(dirname "$0")" && pwd)
workspace=$here/../..
# The version is that of all crates.
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' "$workspace/Cargo.toml" | head -n 1)

if [ $# = 2 ]; then
  built=$2
else
  built=${CARGO_TARGET_DIR:-$workspace/target}/release
  # All libraries of the workspace, so that this one is built of the same parts as the command.
  cargo build --release --locked --workspace --lib --manifest-path "$workspace/Cargo.toml"
fi

mkdir -p "$1/include" "$1/lib/pkgconfig" "$1/lib/cmake/ringwing"
cp "$here/include/ringwing.h" "$1/include/"
cp "$built/libringwing.a" "$1/lib/"
# The name that programs link with leads to the one that they look for at their start, and that one to the file of this version.
cp "$built/libringwing.so" "$1/lib/libringwing.so.1.$version"
ln -sf "libringwing.so.1.$version" "$1/lib/libringwing.so.1"
ln -sf libringwing.so.1 "$1/lib/libringwing.so"
sed "s/@VERSION@/$version/" "$here/package/ringwing.pc" >"$1/lib/pkgconfig/ringwing.pc"
cp "$here/package/ringwingConfig.cmake" "$1/lib/cmake/ringwing/"
sed "s/@VERSION@/$version/" "$here/package/ringwingConfigVersion.cmake" >"$1/lib/cmake/ringwing/ringwingConfigVersion.cmake"
