#!/usr/bin/env bash
# Builds the pages into crates/lab/assets, where the program takes them from. Needs node.
#   build.sh          builds them
#   build.sh --check  fails where what is checked in is not what the sources build
set -euo pipefail
cd "$(dirname "$0")"

assets=../assets
out=$assets
if [ "${1:-}" = "--check" ]; then
    out=$(mktemp -d)
    trap 'rm -r "$out"' EXIT
fi

npm ci --no-audit --no-fund --silent
npx tsc --project tsconfig.json
for page in lab watch report; do
    npx esbuild "src/$page.ts" --bundle --minify --format=iife --target=es2022 --log-level=warning \
        --outfile="$out/$page.js"
done
for style in style report; do
    npx esbuild "src/$style.css" --bundle --minify --log-level=warning --outfile="$out/$style.css"
done
cp src/lab.html src/watch.html node_modules/uplot/dist/uPlot.iife.min.js node_modules/uplot/dist/uPlot.min.css "$out/"
cp node_modules/uplot/LICENSE "$out/uPlot.LICENSE"

if [ "$out" != "$assets" ]; then
    diff -r "$assets" "$out"
    echo "crates/lab/assets is what crates/lab/web builds"
fi
