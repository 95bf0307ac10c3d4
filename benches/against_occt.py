#!/usr/bin/env python3
"""Facets and time against OpenCASCADE's BRepMesh at the same reached sag.

Needs Python with numpy and OCP (cadquery-ocp 7.8); neither is a dependency of lampyris. Files are STEP.

    cargo build --release
    taskset -c 0-2 python benches/against_occt.py target/release/lampyris fixtures/step/*.stp --tolerance 0.05 -o RESULT.json
    taskset -c 0-2 python benches/against_occt.py target/release/lampyris CORPUS/*.stp --no-worse --deflections reference.json -o RESULT.json

How it is made fair. Both run on the cores this script is bound to, BRepMesh with IsParallel. Sag is the largest distance, over
points of the surface at evenly spread parameters of each triangle, to that triangle; ours reports it by the same rule (`sampled_max` of
`lampyris facet --json`). By default BRepMesh's linear deflection is bisected to the coarsest one whose sag is not above ours.
With `--no-worse` BRepMesh runs once at the deflection of the file, and ours is tightened until its sag is not above. Rounds alternate;
ours pays for a fresh process every time, BRepMesh meshes the same shape again with its triangulation removed. Reading is not timed.
"""
import argparse
import json
import os
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


def occt(shape, deflection, angle):
    BRepTools.Clean_s(shape)
    start = time.perf_counter()
    BRepMesh_IncrementalMesh(shape, deflection, False, angle, True)
    return time.perf_counter() - start


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


def ours(command, path, tolerance):
    try:
        done = subprocess.run(
            [command, "facet", path, "--tolerance", repr(tolerance), "--json"], capture_output=True, text=True, timeout=300
        )
        return json.loads(done.stdout)
    except (subprocess.TimeoutExpired, json.JSONDecodeError):
        return None


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


def row(args, path, deflection):
    shape = read(path)
    if shape is None:
        return {"file": os.path.basename(path), "skipped": "OCCT reads no shape"}
    out = {"file": os.path.basename(path)}
    tolerance = args.tolerance
    if args.no_worse:
        occt(shape, deflection, args.angle)
        triangles, sag, empty = reached(shape)
        tolerance, mine = deflection, None
        for _ in range(8):
            mine = ours(args.command, path, tolerance)
            if mine is None or not mine["facets"] or (mine["sag_mm"]["sampled_max"] or 0.0) <= max(sag, 1e-6):
                break
            tolerance *= 0.8
        found = (deflection, triangles, sag)
        out["occt_faces_without"] = empty
    else:
        mine = ours(args.command, path, tolerance)
        each = [coarsest(shape, mine["sag_mm"]["sampled_max"], tolerance, angle) for angle in args.angles]
        best = min((f + (a,) for f, a in zip(each, args.angles) if f), key=lambda f: f[1], default=None)
        if best is None:
            return {**out, "skipped": "BRepMesh does not reach the sag"}
        found, args.angle = best[:3], best[3]
    if mine is None or not mine["facets"]:
        return {**out, "skipped": "no facets"}
    first, second = [], []
    for _ in range(args.rounds):
        first.append(ours(args.command, path, tolerance)["seconds"]["tessellate"])
        second.append(occt(shape, found[0], args.angle))
    out |= {
        "tolerance_mm": tolerance, "facets": mine["facets"], "sag_mm": mine["sag_mm"]["sampled_max"],
        "occt_deflection_mm": found[0], "occt_angle_rad": args.angle, "occt_triangles": found[1], "occt_sag_mm": found[2],
        "facets_ratio": mine["facets"] / max(found[1], 1),
        "seconds_min": min(first), "seconds_median": float(np.median(first)),
        "occt_seconds_min": min(second), "occt_seconds_median": float(np.median(second)),
        "faster_min": min(second) / max(min(first), 1e-9), "faster_median": float(np.median(second) / max(np.median(first), 1e-9)),
    }
    return out


def main():
    parse = argparse.ArgumentParser()
    parse.add_argument("command")
    parse.add_argument("files", nargs="+")
    parse.add_argument("--tolerance", type=float, default=0.05)
    parse.add_argument("--no-worse", action="store_true")
    parse.add_argument("--deflections", help="JSON with files/NAME/linear_deflection_mm; 0.1 where absent")
    parse.add_argument("--angles", type=float, nargs="+", default=[0.5, 1.2])
    parse.add_argument("--rounds", type=int, default=5)
    parse.add_argument("-o", "--output")
    args = parse.parse_args()
    args.angle = 0.5
    known = json.load(open(args.deflections))["files"] if args.deflections else {}
    rows = []
    for path in args.files:
        deflection = known.get(os.path.basename(path), {}).get("linear_deflection_mm") or 0.1
        rows.append(row(args, path, deflection))
        print(json.dumps(rows[-1]), file=sys.stderr, flush=True)
    timed = [r for r in rows if "skipped" not in r]
    result = {
        "command": " ".join(sys.argv), "hardware": "AMD EPYC, 4 cores", "cores": len(os.sched_getaffinity(0)), "rounds": args.rounds,
        "seconds_total": sum(r["seconds_min"] for r in timed), "occt_seconds_total": sum(r["occt_seconds_min"] for r in timed),
        "rows": rows,
    }
    text = json.dumps(result, indent=1)
    if args.output:
        open(args.output, "w").write(text + "\n")
    else:
        print(text)


main()
