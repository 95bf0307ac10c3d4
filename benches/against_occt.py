#!/usr/bin/env python3
"""Facets and time against OpenCASCADE's BRepMesh at the same reached sag: a row a file, totals, and JSON.

Needs Python with numpy and OCP (cadquery-ocp 7.8); neither is a dependency of lampyris. Files are STEP.

    cargo bench --bench against_occt --no-run
    OURS=target/release/deps/against_occt-HASH
    python benches/against_occt.py $OURS fixtures/step/*.stp --tolerance 0.05 -o FOLDER
    python benches/against_occt.py $OURS CORPUS/*.stp --corpus CORPUS/reference.json -o FOLDER

How it is made fair. Both run on the cores this script is bound to (`taskset`), BRepMesh with IsParallel, both warm in one
process, both from a model that is read already; only meshing is timed. Rounds of the two alternate, the least of each counts.
Sag is the largest distance, over points of the surface at evenly spread parameters of each triangle, to that triangle, sampled
by the same rule on both sides; of large meshes BRepMesh's triangles are sampled in part, which counts for it.

With `--tolerance` ours meshes at it, and BRepMesh's linear deflection is bisected to the coarsest whose sag is not above ours, at the
better of two angles. With `--corpus` BRepMesh meshes at the deflection that the file lists (0.1 mm where none), ours at the loosest tolerance up
to that deflection whose sag is not above BRepMesh's. Where BRepMesh's sag is larger than it was asked, ours stays at the deflection; `same_sag`
in the row then gives the time of BRepMesh tightened until it reaches our sag.
"""
import argparse
import json
import os
import platform
import resource
import select
import subprocess
import sys
import time

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.IFSelect import IFSelect_RetDone
from OCP.Interface import Interface_Static
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

MOST_SAMPLED = 1500  # triangles of one file whose sag is sampled; what is missed counts for BRepMesh


def read(path):
    reader = STEPControl_Reader()
    Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")
    if reader.ReadFile(path) != IFSelect_RetDone:
        return None
    reader.TransferRoots()
    shape = reader.OneShape()
    return None if shape.IsNull() else shape


def faces(shape):
    walk = TopExp_Explorer(shape, TopAbs_FACE)
    while walk.More():
        yield TopoDS.Face_s(walk.Current())
        walk.Next()


def processor():
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def occt(shape, deflection, angle):
    BRepTools.Clean_s(shape)
    start, before = time.perf_counter(), processor()
    BRepMesh_IncrementalMesh(shape, deflection, False, angle, True)
    return time.perf_counter() - start, processor() - before


def to_triangle(p, a, b, c):
    """Distances of points p[k] to the triangles a[k], b[k], c[k]."""
    def to_segment(x, y):
        d = y - x
        length = np.maximum((d * d).sum(-1), 1e-300)
        t = np.clip(((p - x) * d).sum(-1) / length, 0, 1)
        return np.linalg.norm(p - x - d * t[..., None], axis=-1)

    best = np.minimum(np.minimum(to_segment(a, b), to_segment(b, c)), to_segment(c, a))
    n = np.cross(b - a, c - a)
    length = np.linalg.norm(n, axis=-1)
    inside = length > 0
    for x, y in ((a, b), (b, c), (c, a)):
        inside &= (np.cross(y - x, p - x) * n).sum(-1) >= 0
    flat = np.abs(((p - a) * n).sum(-1)) / np.maximum(length, 1e-300)
    return np.where(inside, flat, best)


def reached(shape, grid=4):
    """Triangles, largest sampled sag, faces without triangles."""
    weights = np.array([[(grid - i - j) / grid, i / grid, j / grid] for i in range(grid + 1) for j in range(grid + 1 - i)])
    total, empty, work = 0, 0, []
    for face in faces(shape):
        mesh = BRep_Tool.Triangulation_s(face, TopLoc_Location())
        if mesh is None:
            empty += 1
            continue
        total += mesh.NbTriangles()
        work.append((face, mesh))
    step = max(1, total // MOST_SAMPLED)
    worst = 0.0
    for face, mesh in work:
        if not mesh.HasUVNodes():
            continue
        place = TopLoc_Location()
        surface = BRep_Tool.Surface_s(face, place)
        mesh_place = TopLoc_Location()
        BRep_Tool.Triangulation_s(face, mesh_place)
        onto = place.Transformation() if not place.IsIdentity() else None
        nodes = []
        for i in range(1, mesh.NbNodes() + 1):
            p = mesh.Node(i)
            if not mesh_place.IsIdentity():
                p = p.Transformed(mesh_place.Transformation())
            uv = mesh.UVNode(i)
            nodes.append((p.X(), p.Y(), p.Z(), uv.X(), uv.Y()))
        nodes = np.array(nodes)
        corners = np.array([mesh.Triangle(i).Get() for i in range(1, mesh.NbTriangles() + 1, step)]) - 1
        at = np.einsum("sk,tkd->tsd", weights, nodes[corners][:, :, 3:])
        points = np.empty(at.shape[:2] + (3,))
        for t in range(at.shape[0]):
            for s in range(at.shape[1]):
                p = surface.Value(at[t, s, 0], at[t, s, 1])
                if onto is not None:
                    p = p.Transformed(onto)
                points[t, s] = (p.X(), p.Y(), p.Z())
        a, b, c = (np.broadcast_to(nodes[corners[:, k], None, :3], points.shape) for k in range(3))
        worst = max(worst, float(to_triangle(points, a, b, c).max()))
    return total, worst, empty


class Ours:
    """The program of `against_occt.rs`, asked line by line."""

    def __init__(self, command):
        self.command, self.process = command, None

    def __call__(self, path, tolerance, rounds=1, measure=False, limit=120):
        if self.process is None:
            self.process = subprocess.Popen([self.command, "--bench"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.process.stdin.write(f"{path}\t{tolerance!r}\t{rounds}\t{int(measure)}\n")
        self.process.stdin.flush()
        if not select.select([self.process.stdout], [], [], limit)[0]:
            self.process.kill()
            self.process = None
            return None
        answer = json.loads(self.process.stdout.readline())
        return None if answer.get("unread") or not answer["facets"] else answer


def coarsest(shape, sag, start, angle):
    """The coarsest deflection found whose sag is at most `sag`, with its triangles and sag."""
    found, low, high = None, None, None
    deflection = start
    for _ in range(8):
        occt(shape, deflection, angle)
        triangles, worst, _ = reached(shape)
        if worst <= sag:
            low = deflection
            if found is None or triangles <= found[1]:
                found = (deflection, triangles, worst)
        else:
            high = deflection
        if low and high:
            deflection = (low * high) ** 0.5
            if high / low < 1.08:
                break
        else:
            deflection *= 1.6 if low else 0.6
        if deflection > 1e3 or deflection < 1e-5:
            break
    return found


def no_coarser(ours, path, deflection, sag):
    """Our loosest tolerance found, up to the deflection, whose sag is at most `sag`; with what came out."""
    mine = ours(path, deflection, measure=True)
    if mine is None or (mine["sag_mm"] or 0.0) <= max(sag, 1e-6):
        return deflection, mine
    low, high, best = None, deflection, None
    for _ in range(7):
        # Our sag is nearly the tolerance: start there.
        tolerance = (low * high) ** 0.5 if low else min(0.97 * sag, 0.8 * high)
        mine = ours(path, tolerance, measure=True)
        if mine is None:
            break
        if (mine["sag_mm"] or 0.0) <= sag:
            low, best = tolerance, (tolerance, mine)
        else:
            high = tolerance
        if low and high / low < 1.05:
            break
    return best or (deflection, None)


def row(args, ours, path, deflection):
    out = {"file": os.path.basename(path)}
    shape = read(path)
    if shape is None:
        return {**out, "skipped": "OCCT reads no shape"}
    angle = args.angles[0]
    if args.corpus:
        occt(shape, deflection, angle)
        triangles, sag, empty = reached(shape)
        tolerance, mine = no_coarser(ours, path, deflection, sag)
        found = (deflection, triangles, sag)
        out["occt_faces_without"] = len(empty) if isinstance(empty, list) else empty
    else:
        tolerance, mine = args.tolerance, ours(path, args.tolerance, measure=True)
        if mine is not None:
            each = [coarsest(shape, mine["sag_mm"], tolerance, angle) for angle in args.angles]
            best = min((f + (a,) for f, a in zip(each, args.angles) if f), key=lambda f: f[1], default=None)
            if best is None:
                return {**out, "skipped": "BRepMesh does not reach the sag"}
            found, angle = best[:3], best[3]
    if mine is None:
        return {**out, "skipped": "no facets, or over two minutes"}
    first, second = [], []
    for _ in range(args.rounds):
        again = ours(path, tolerance)
        if again is None:
            return {**out, "skipped": "over two minutes"}
        first.append((again["seconds"], again["processor_seconds"]))
        second.append(occt(shape, found[0], angle))
    best = [min(x) for x in zip(*first)]
    theirs = [min(x) for x in zip(*second)]
    out |= {
        "tolerance_mm": tolerance, "facets": mine["facets"], "certified": mine["certified"], "sag_mm": mine["sag_mm"],
        "occt_deflection_mm": found[0], "occt_angle_rad": angle, "occt_triangles": found[1], "occt_sag_mm": found[2],
        "facets_ratio": mine["facets"] / max(found[1], 1),
        "seconds": best[0], "processor_seconds": best[1], "seconds_median": float(np.median([x[0] for x in first])),
        "occt_seconds": theirs[0], "occt_processor_seconds": theirs[1], "occt_seconds_median": float(np.median([x[0] for x in second])),
        "faster": theirs[0] / max(best[0], 1e-9), "faster_processor": theirs[1] / max(best[1], 1e-9),
    }
    if args.corpus and found[2] > 1.05 * mine["sag_mm"] and not args.quick:
        tight = coarsest(shape, mine["sag_mm"], 0.7 * deflection, angle)
        times = [occt(shape, tight[0], angle) for _ in range(2)] if tight else []
        out["same_sag"] = times and {
            "occt_deflection_mm": tight[0], "occt_triangles": tight[1], "occt_sag_mm": tight[2],
            "occt_seconds": min(t[0] for t in times), "occt_processor_seconds": min(t[1] for t in times),
        } or None
    return out


def at_our_sag(row):
    """How many times as fast, with BRepMesh tightened to our sag where it missed the deflection."""
    return (row.get("same_sag") or row)["occt_seconds"] / max(row["seconds"], 1e-9)


def table(rows):
    print(f"{'file':44} {'facets':>8} {'OCCT':>8} {'sag':>8} {'OCCT':>8} {'ms':>9} {'OCCT':>9} {'faster':>7} {'by CPU':>7} {'at sag':>7}")
    for r in rows:
        if "skipped" in r:
            print(f"{r['file'][:44]:44} {r['skipped']}")
            continue
        print(
            f"{r['file'][:44]:44} {r['facets']:8} {r['occt_triangles']:8} {r['sag_mm']:8.4f} {r['occt_sag_mm']:8.4f} "
            f"{1e3 * r['seconds']:9.2f} {1e3 * r['occt_seconds']:9.2f} {r['faster']:7.2f} {r['faster_processor']:7.2f} {at_our_sag(r):7.2f}"
        )


def totals(rows):
    timed = [r for r in rows if "skipped" not in r]
    both = lambda name: [sum(r[name] for r in timed), sum((r.get("same_sag") or r)["occt_" + name] for r in timed)]
    sums = {}
    for name in ("seconds", "processor_seconds"):
        own, tightened = both(name)
        listed = sum(r["occt_" + name] for r in timed)
        sums[name] = {
            "ours": own, "occt": listed, "occt_tightened_to_our_sag": tightened,
            "faster": listed / max(own, 1e-9), "faster_at_our_sag": tightened / max(own, 1e-9),
        }
    return {
        "files": len(timed), "facets": sum(r["facets"] for r in timed), "certified": sum(r["certified"] for r in timed),
        "occt_triangles": sum(r["occt_triangles"] for r in timed), **sums,
        "faster_median_of_files": float(np.median([r["faster"] for r in timed])) if timed else None,
        "faster_at_our_sag_median_of_files": float(np.median([at_our_sag(r) for r in timed])) if timed else None,
        "facets_ratio_median_of_files": float(np.median([r["facets_ratio"] for r in timed])) if timed else None,
    }


def main():
    parse = argparse.ArgumentParser()
    parse.add_argument("command", help="the program built from against_occt.rs")
    parse.add_argument("files", nargs="+")
    parse.add_argument("--tolerance", type=float, default=0.05, help="ours, mm; BRepMesh is bisected to the sag it reaches")
    parse.add_argument("--corpus", help="JSON with files/NAME/linear_deflection_mm; both mesh at those, 0.1 where absent")
    parse.add_argument("--angles", type=float, nargs="+", default=[0.5, 1.2], help="BRepMesh's, rad; --corpus takes the first")
    parse.add_argument("--rounds", type=int, default=5)
    parse.add_argument("--quick", action="store_true", help="no bisection of BRepMesh where it misses the deflection")
    parse.add_argument("-o", "--output", help="folder for against-occt-fixtures.json or against-occt-corpus.json")
    args = parse.parse_args()
    known = json.load(open(args.corpus))["files"] if args.corpus else {}
    ours, rows = Ours(args.command), []
    for path in args.files:
        deflection = known.get(os.path.basename(path), {}).get("linear_deflection_mm") or 0.1
        rows.append(row(args, ours, path, deflection))
        print(json.dumps(rows[-1]), file=sys.stderr, flush=True)
    table(rows)
    total = totals(rows)
    print(json.dumps(total, indent=1))
    if args.output:
        os.makedirs(args.output, exist_ok=True)
        result = {
            "command": " ".join(sys.argv), "machine": platform.processor() or platform.machine(),
            "cores": len(os.sched_getaffinity(0)), "load": os.getloadavg()[0], "rounds": args.rounds, "totals": total, "rows": rows,
        }
        name = "against-occt-corpus.json" if args.corpus else "against-occt-fixtures.json"
        with open(os.path.join(args.output, name), "w") as out:
            out.write(json.dumps(result, indent=1) + "\n")


main()
