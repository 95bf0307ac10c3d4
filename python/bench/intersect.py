"""What the way through Python costs over the crate's own call, on the same rays in alternating rounds.

    python bench/intersect.py [rays] [rounds]

Two calls of the crate stand beside `Octree.intersect`, on the same threads: `arrays` reads the same arrays and fills the same ones, so that
the rest is what Python itself costs; `own` reads rays and writes hits of the crate's own types, made beforehand.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time

import numpy as np

import lampyris as lp


def main(rays: int = 10_000_000, rounds: int = 9) -> None:
    with tempfile.TemporaryDirectory() as folder:
        lp.write_demo(folder)
        mesh = lp.read_step(f"{folder}/lamp.stp").tessellate((0.05, 0.2))
    tree = lp.Octree(mesh)
    random = np.random.default_rng(1)
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    origins = random.uniform(low, high, (rays, 3))
    directions = random.normal(size=(rays, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    seconds: dict[str, list[float]] = {"Python": [], "arrays": [], "own": []}
    for _ in range(rounds):
        start = time.perf_counter()
        hits = tree.intersect(origins, directions)
        seconds["Python"].append(time.perf_counter() - start)
        found = int(np.isfinite(hits.t).sum())
        del hits
        arrays, own, expected = tree._core.seconds_of_rust_call(origins, directions)
        seconds["arrays"].append(arrays)
        seconds["own"].append(own)
        assert found == expected
    print(f"{rays} rays on {len(mesh)} facets, {rounds} rounds")
    for name, times in seconds.items():
        print(f"{name}: least {min(times):.3f} s, median {statistics.median(times):.3f} s, most {max(times):.3f} s")
    for name in ("arrays", "own"):
        least = min(seconds["Python"]) / min(seconds[name])
        middle = statistics.median(p / r for p, r in zip(seconds["Python"], seconds[name]))
        print(f"Python over {name}: {least:.3f} by the least, {middle:.3f} by the median of the rounds")


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
