"""What the way through Python costs over the crate's own call, on the same rays in alternating rounds.

    python bench/intersect.py [rays] [rounds]
"""

from __future__ import annotations

import sys
import tempfile
import time

import numpy as np

import lampyris as lp


def main(rays: int = 10_000_000, rounds: int = 5) -> None:
    with tempfile.TemporaryDirectory() as folder:
        lp.write_demo(folder)
        mesh = lp.read_step(f"{folder}/lamp.stp").tessellate((0.05, 0.2))
    tree = lp.Octree(mesh)
    random = np.random.default_rng(1)
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    origins = random.uniform(low, high, (rays, 3))
    directions = random.normal(size=(rays, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    python, rust = [], []
    for _ in range(rounds):
        start = time.perf_counter()
        hits = tree.intersect(origins, directions)
        python.append(time.perf_counter() - start)
        found = int(np.isfinite(hits.t).sum())
        del hits
        seconds, expected = tree._core.seconds_of_rust_call(origins, directions)
        rust.append(seconds)
        assert found == expected
    ratio = min(python) / min(rust)
    print(f"{rays} rays on {len(mesh)} facets: Python {min(python):.3f} s, Rust {min(rust):.3f} s, ratio {ratio:.3f}")


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
