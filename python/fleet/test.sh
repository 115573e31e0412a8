#!/usr/bin/env bash
# A fleet on Spark in local-cluster mode and on Ray, against one process of the program. It needs Java 17 or later beside what
# python/test.sh needs, and takes minutes; FLEET_VALVES and FLEET_CYCLES make the fleet larger.
set -euo pipefail
cd "$(dirname "$0")/../.."

export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}"
environment="$CARGO_TARGET_DIR/python-fleet"
[ -x "$environment/bin/python" ] || python3 -m venv "$environment"
# shellcheck disable=SC1091 # made above
. "$environment/bin/activate"
pip install --quiet "pyspark[sql]>=4,<5" "pandas>=2.2,<3" "pyarrow>=15" "numpy>=1.24" \
    "ray[data]>=2.60,<3" "pytest>=8" "maturin>=1.9,<2"
maturin develop --release --locked --quiet >/dev/null
python -m pytest -q -rs "$@" python/fleet
