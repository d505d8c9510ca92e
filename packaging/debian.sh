#!/usr/bin/env bash
# Makes target/debian/ringwing_*.deb. Needs cargo-deb (`cargo install cargo-deb`).
set -euo pipefail
cd "$(dirname "$0")/.."

cargo build --release --locked
# The man pages and completions come from the command itself, so that they cannot differ from it.
rm -rf target/package-files
target/release/ringwing package-files target/package-files
# The library for controllers in C and C++. Without the static one: a program that is linked with it does not follow an upgrade.
controller/c/install.sh target/package-files/c target/release
cargo deb --no-build --locked
