#!/usr/bin/env python3
"""Puts one deliberate fault at a time into a copy of the source and asks whether the default tests notice.

    tests/mutants/run.py [--list] [--check] [--only TEXT] [--work FOLDER] [--jobs N]

Each mutant is a file, a text that stands there exactly once, what takes its place, and the tests that ought to notice it. `--check` only looks whether
every text still stands where it should. A mutant is *killed* when a test fails or the program no longer compiles by a lint of the
compiler; *survivors* are listed at the end, and the exit code is their number. Nothing but Python 3.9 and the Rust toolchain is needed."""
import argparse
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
EXACT, OCTREE, PROOF, KERNEL = "src/intersect/exact/", "src/intersect/octree/", "src/tessellate/proof/", "src/simulate/kernel/"

# (name, file, text, replacement, tests)
MUTANTS = [
    # The certified core: what a certificate promises.
    ("own point found again", EXACT + "acceptance.rs", "if query.departure.is_some_and(|own| own.is_same_point(leaf, local, t, &self.geometry)) {",
     "if false && query.departure.is_some_and(|own| own.is_same_point(leaf, local, t, &self.geometry)) {", "exact simulate"),
    ("own point accepted within 1e-3 mm", EXACT + "acceptance.rs", "if query.departure.is_some_and(|own| own.is_same_point(leaf, local, t, &self.geometry)) {",
     "if query.departure.is_some_and(|own| t.abs() < 1e-3 || own.is_same_point(leaf, local, t, &self.geometry)) {", "exact simulate"),
    ("trims forgotten at the border", EXACT + "acceptance.rs", "            if !inside {", "            if false && !inside {", "exact"),
    ("trims forgotten in cells", EXACT + "acceptance.rs", "return (decided == Region::Inside, false)", "return (true, false)", "exact"),
    ("rejections at trims not told", EXACT + "acceptance.rs", "query.reject_at_trim(t);", "let _ = t;", "exact"),
    ("edges do not decide", EXACT + "acceptance.rs", "Some(inside) => inside,", "Some(_) => place.inside,", "exact"),
    ("two roots taken for one", EXACT + "leaf_test.rs", "const UNIQUE: f64 = 0.95;", "const UNIQUE: f64 = 3.0;", "exact study"),
    ("rounding margin dropped", EXACT + "leaf_test.rs", "let margin = PARAMETER_ROUNDING + noise *", "let margin = 0.0 * noise *", "exact study"),
    ("Krawczyk radius forgotten", EXACT + "leaf_test.rs", "(1.0 + row_u + INVERSE_ROUNDING) + margin", "(1.0 + INVERSE_ROUNDING) + margin", "exact study"),
    ("Krawczyk reach a third", EXACT + "leaf_test.rs", "let reach_v = f64::from(leaf.half[1]) * (1.0 + row_v + INVERSE_ROUNDING) + margin;",
     "let reach_v = (f64::from(leaf.half[1]) * (1.0 + row_v + INVERSE_ROUNDING) + margin) / 3.0;", "exact study"),
    ("singular Jacobians inverted", EXACT + "tolerances.rs", "pub(super) const SINGULAR: f64 = 1e-8;", "pub(super) const SINGULAR: f64 = 0.0;", "exact study"),
    ("roots counted far beside the leaf", EXACT + "leaf_test.rs", "let e = margin + 2.0 * NEWTON_STEP;", "let e = margin + 0.05;", "exact study"),
    ("range not asked at the only root", EXACT + "acceptance.rs", "if !query.is_in_range(t) {", "if false && !query.is_in_range(t) {", "exact"),
    ("oriented box without rounding", EXACT + "leaf_test.rs", "(leaf.olo[k] - noise - o) * inv, (leaf.ohi[k] + noise - o) * inv", "(leaf.olo[k] + 1e-3 - o) * inv, (leaf.ohi[k] - 1e-3 - o) * inv", "exact study"),
    ("doubt forgotten at a hit", EXACT + "answer.rs", "let certainty = if query.undecided_from <= root.t {", "let certainty = if false {", "exact study"),
    ("doubt forgotten at a miss", EXACT + "answer.rs", "let undecided = query.undecided_from < f64::INFINITY;", "let undecided = false;", "exact study"),
    ("doubt forgotten in a passage", EXACT + "answer.rs", "if hit.t >= query.undecided_from {", "if false {", "exact study"),
    ("doubt forgotten when the budget ends", EXACT + "clip.rs", "query.undecided_from = query.undecided_from.min(node.near);", "", "exact study"),
    ("normal swapped", EXACT + "answer.rs", "let normal = label.sign * regular", "let normal = -label.sign * regular", "exact"),
    ("clipping takes two roots for one", EXACT + "clip.rs", "const UNIQUE: f64 = 0.9;", "const UNIQUE: f64 = 3.0;", "exact study"),
    ("clipping drops its slack", EXACT + "clip.rs", "keep[k] = [keep[k][0] - y.slack[k], keep[k][1] + y.slack[k]];", "keep[k] = [keep[k][0] + 1e-6, keep[k][1] - 1e-6];", "exact study"),
    ("clipping drops boxes before the start", EXACT + "clip.rs", "hull.far < query.t_min - TANGENT", "hull.far < query.t_min + 1.0", "exact study"),
    ("clipping prefers the later box", EXACT + "clip.rs", "if node.near >= query.t_max && query.best.is_some() {", "if node.near >= query.t_max * 0.5 && query.best.is_some() {", "exact study"),
    # Polishing.
    ("polish accepts a point off the ray", EXACT + "newton.rs", "if residual > near + rounding {", "if residual > 1e-2 {", "exact"),
    ("polish swaps normals of reversed faces", EXACT + "newton.rs", "let normal = record.sign * patch::normal", "let normal = patch::normal", "exact simulate"),
    ("polish forgets seams", EXACT + "newton.rs", "uv[k] = if grid.closed[k] && uv[k]", "uv[k] = if false && uv[k]", "exact"),
    # The octree: rounding, boxes, sieve.
    ("box not rounded down", OCTREE + "clip.rs", "if f64::from(y) > x { y.next_down() } else { y }", "y", "intersect study --lib"),
    ("box not rounded up", OCTREE + "clip.rs", "if f64::from(y) < x { y.next_up() } else { y }", "y", "intersect study --lib"),
    ("boxes unpadded and shrunk", OCTREE + "clip.rs", "round_down(low[a] - pad)", "round_down(low[a] + 0.01 * (high[a] - low[a]))", "intersect study"),
    ("second triangle of a facet left out", OCTREE + "clip.rs", "if c == d { 1 } else { 2 }", "1", "intersect study"),
    ("node bound to nearest below", OCTREE + "node.rs", "/ step).floor();", "/ step).round();", "intersect study"),
    ("node bound to nearest above", OCTREE + "node.rs", "/ step).ceil();", "/ step).round();", "intersect study"),
    ("steps too short", OCTREE + "node.rs", "const STEP_ROOM: f64 = 1.0 + 1e-6;", "const STEP_ROOM: f64 = 1.0 - 1e-3;", "intersect study"),
    ("box slack dropped", OCTREE + "ray_state.rs", "b.slack[a] = ((4.0 * o.abs() + frame.reach[a]) * ROUNDING + moved) * inverse.abs();", "b.slack[a] = 0.0 * (o.abs() + frame.reach[a] + ROUNDING + moved) * inverse.abs();", "intersect study"),
    ("sieve slack dropped", OCTREE + "ray_state.rs", "self.sieve.slack = moved;", "self.sieve.slack = 0.0 * moved;", "intersect study"),
    # The proof of facets.
    ("Taylor bound a third", PROOF + "deviation.rs", "/ (8.0 * lightest))", "/ (24.0 * lightest))", "tessellate --lib"),
    ("mixed derivative forgotten", PROOF + "deviation.rs", "(most[0] + 2.0 * most[1] + most[2])", "(most[0] + most[2])", "tessellate --lib"),
    ("weight forgotten", PROOF + "deviation.rs", "lightest = lightest.min(w_min);", "lightest = lightest.min(w_max);", "tessellate --lib"),
    ("height of the quad forgotten", PROOF + "flat_quad.rs", "let flat = sides - quad.height;", "let flat = sides;", "tessellate --lib"),
    ("slope of the quad forgotten", PROOF + "flat_quad.rs", "let sides = limit * quad.cosine - self.margin;", "let sides = 3.0 * limit - self.margin;", "tessellate --lib"),
    # Tallies.
    ("squares of other replicates forgotten", "src/simulate/tally.rs", "self.squares = self.squares.saturating_add(o.squares);", "", "simulate cli --lib"),
    ("rounding of quanta downward", "src/simulate/tally.rs", "(x + SHIFT) - SHIFT } else", "x.floor() } else", "simulate --lib"),
    ("a waiting cell is lost", "src/simulate/tally.rs", "    pub(crate) fn flush(&mut self, sums: &mut [Sum]) {\n        self.add_pending();", "    pub(crate) fn flush(&mut self, sums: &mut [Sum]) {", "simulate --lib"),
    ("error without its correction", "src/simulate/tally.rs", "(squares - total * total / k).max(0.0) * k / (k - 1.0)", "(squares - total * total / k).max(0.0) / (k - 1.0)", "simulate --lib"),
    # Contacts.
    ("partner looks the same way", KERNEL + "contact.rs", "let against = found.geometric_normal.dot(at.hit.geometric_normal) < -ALIGNED;\n        other.touches_body", "let against = found.geometric_normal.dot(at.hit.geometric_normal) > ALIGNED;\n        other.touches_body", "simulate"),
    ("coating of the wrong face", KERNEL + "contact.rs", "[false, false] if entering => ContactSurface::Partner(partner),", "[false, false] if !entering => ContactSurface::Partner(partner),", "simulate"),
    ("coating of a partner forgotten", KERNEL + "contact.rs", "[true, false] => ContactSurface::Partner(partner),", "[true, false] => ContactSurface::Bare,", "simulate"),
    ("rounding of places a thousandth", KERNEL + "tolerances.rs", "const ROUNDING_MM: f64 = 1e-9;", "const ROUNDING_MM: f64 = 1e-14;", "simulate"),
    # Optics.
    ("mirror image of the wrong length", "src/optics/refraction.rs", "unit(d - n * (2.0 * d.dot(n)))", "unit(d - n * (1.999 * d.dot(n)))", "simulate --lib"),
    ("total reflection misjudged", "src/optics/refraction.rs", "(sin2_t < 1.0).then(", "(sin2_t < 0.999).then(", "simulate --lib"),
]


def source(mutant):
    return (ROOT / mutant[1]).read_text(encoding="utf8")


def check(mutants):
    """Names of mutants whose text does not stand exactly once in its file."""
    bad = []
    for mutant in mutants:
        path = ROOT / mutant[1]
        count = path.read_text(encoding="utf8").count(mutant[2]) if path.is_file() else -1
        if count != 1:
            bad.append(f"{mutant[0]}: {mutant[1]} holds its text {count} times" if count >= 0 else f"{mutant[0]}: {mutant[1]} is gone")
    return bad


def targets(tests):
    return [part for name in tests.split() for part in (["--lib"] if name == "--lib" else ["--test", name])]


def run(mutant, copy, jobs):
    """Whether the tests notice, the seconds it took and the first line that says so."""
    path = copy / mutant[1]
    original = path.read_text(encoding="utf8")
    start = time.time()
    try:
        path.write_text(original.replace(mutant[2], mutant[3]), encoding="utf8")
        command = ["cargo", "test", "--offline", "--quiet", "-j", str(jobs), *targets(mutant[4])]
        done = subprocess.run(command, cwd=copy, capture_output=True, text=True)
    finally:
        path.write_text(original, encoding="utf8")
    lines = (done.stdout + done.stderr).splitlines()
    why = next((line for line in lines if "FAILED" in line or line.startswith("error") or "panicked at" in line), "")
    return done.returncode != 0, time.time() - start, why.strip()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--list", action="store_true", help="names alone")
    parser.add_argument("--check", action="store_true", help="does every text still stand where it should?")
    parser.add_argument("--only", default="", help="mutants whose name or file contains this")
    parser.add_argument("--work", type=Path, default=ROOT / "target" / "mutants", help="where the copy is kept")
    parser.add_argument("--jobs", type=int, default=4)
    options = parser.parse_args()
    chosen = [m for m in MUTANTS if options.only in m[0] or options.only in m[1]]
    if options.list:
        print("\n".join(f"{m[0]:45} {m[1]}" for m in chosen))
        return 0
    stale = check(chosen)
    print("\n".join(stale) or f"{len(chosen)} mutants stand where they should")
    if options.check:
        return len(stale)
    names = [line.split(":")[0] for line in stale]
    copy = options.work
    skipped = shutil.ignore_patterns("target", ".git", "lampyris-*")
    shutil.copytree(ROOT, copy, ignore=skipped, dirs_exist_ok=True)
    survivors = []
    for mutant in (m for m in chosen if m[0] not in names):
        killed, seconds, why = run(mutant, copy, options.jobs)
        print(f"{'killed ' if killed else 'SURVIVED'} {seconds:5.0f} s  {mutant[0]}  {why}", flush=True)
        if not killed:
            survivors.append(mutant[0])
    print(f"{len(survivors)} survivors: {', '.join(survivors) or 'none'}")
    return len(survivors)


if __name__ == "__main__":
    sys.exit(main())
