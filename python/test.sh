#!/usr/bin/env bash
# Builds the Python package into an environment of its own and tests it: lints, types, and its results against the
# program's. It needs Rust, Python 3.10 or later with venv, and the packages of `pyproject.toml`'s extra `test`.
set -euo pipefail
cd "$(dirname "$0")/.."

# Crates of others that the workspace built already need not be built again.
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}"
environment="$CARGO_TARGET_DIR/python"

if ! python3 -c 'import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; then
    echo "skipped: the Python package, no Python 3.10 or later with venv here"
    exit 0
fi
[ -x "$environment/bin/python" ] || python3 -m venv "$environment"
# shellcheck disable=SC1091 # made above
. "$environment/bin/activate"
read -ra packages <<<"$(python - <<'END'
import re
import pathlib

text = pathlib.Path("pyproject.toml").read_text()
extra = re.search(r"^test = \[(.*)\]$", text, re.MULTILINE)
build = re.search(r"^requires = \[(.*)\]$", text, re.MULTILINE)
print(" ".join(re.findall(r'"([^"]+)"', f"{extra[1]}, {build[1]}")), "numpy")
END
)"
if ! pip install --quiet --quiet "${packages[@]}"; then
    echo "skipped: the Python package, its test's packages cannot be installed here"
    exit 0
fi

manifest=python/Cargo.toml
cargo fmt --manifest-path $manifest --check
cargo clippy --manifest-path $manifest --locked -- -D warnings
maturin develop --release --locked --quiet >/dev/null
mypy
python -m pytest -q "$@"
