#!/usr/bin/env bash
# Builds the page into web/dist. Needs Rust with the target wasm32-unknown-unknown, which rustup is asked for.
set -euo pipefail
cd "$(dirname "$0")"

target=wasm32-unknown-unknown
if command -v rustup >/dev/null 2>&1 && ! rustup target list --installed | grep -qx "$target"; then
  rustup target add "$target"
fi
# The flags of .cargo/config.toml hold for builds from this folder, unless the environment has some.
env -u RUSTFLAGS cargo build --release --locked --target "$target"

rm -rf dist
mkdir -p dist/demo
cp page/* dist/
cp ../runtime/demo/source.ply ../runtime/demo/target.ply dist/demo/
cp "target/$target/release/fmnet_web.wasm" dist/fmnet.wasm
echo "web/dist: $(cat dist/*.* | wc -c) bytes to a first match, $(cat dist/*.* | gzip -9 | wc -c) with gzip; the demo pair comes on demand"
