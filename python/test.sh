#!/usr/bin/env bash
# Builds the Python package into the environment that is active, and tests it; `test.sh --quick` leaves notebooks and clusters out.
set -euo pipefail
cd "$(dirname "$0")"
[ -n "${VIRTUAL_ENV:-}${CONDA_PREFIX:-}" ] || { echo "make an environment first: python -m venv .venv && . .venv/bin/activate"; exit 1; }
python -m pip install --quiet "maturin>=1.9.4,<2"
cargo fmt --check
cargo clippy --quiet --release -- -D warnings
maturin develop --release --extras test
cargo build --quiet --release --manifest-path ../Cargo.toml --bin lampyris
if [ "${1:-}" = --quick ]; then
    python -m pytest --ignore tests/test_notebooks.py --ignore tests/test_distributed.py
else
    python -m pytest
fi
