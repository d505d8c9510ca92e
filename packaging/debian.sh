#!/usr/bin/env bash
# Makes target/debian/ringwing_*.deb. Needs cargo-deb (`cargo install cargo-deb`).
set -euo pipefail
cd "$(dirname "$0")/.."

cargo build --release --locked
# The man pages and completions come from the command itself, so that they cannot differ from it.
rm -rf target/package-files
target/release/ringwing package-files target/package-files
cargo deb --no-build --locked
