#!/usr/bin/env python3
"""Rays a second of the three peer scenes against Mitsuba 3, on the same facets, in turns; with `--scenes demo` the peak candela of the lamp.

Needs Python with numpy and mitsuba (PyPI) and an LLVM library; none is a dependency of lampyris. Without them it says so and ends well.

    cargo build --release
    DRJIT_LIBLLVM_PATH=/usr/lib/.../libLLVM.so.19.1 python benches/against_mitsuba.py target/release/lampyris -o RESULT.json

How it is made fair. Both trace the facets that `lampyris facet` writes at the same tolerance, quads as the same two triangles, with
interpolated normals, the same number of rays and the same number of threads. Mitsuba runs as one vectorised loop written for each
scene (variant llvm_ad_rgb, f32, Embree), loaded, compiled and warmed before its clock starts; it chooses reflection or
transmission as ours does, stops at the receiver, and counts 200 x 200 cells. Ours is the `trace` time of `lampyris trace --json`,
each time from a fresh process: f64, receivers, error bars and energy account included. Rounds alternate; the first of each pair
changes from round to round.
"""
import argparse
import json
import math
import os
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

FIXTURES = Path(__file__).resolve().parent.parent / "fixtures"
PARABOLOIDS = ((-95.0, 18.0), (0.0, 24.0), (95.0, 30.0))  # middle in x and focal length of the three mirrors of S2


class Scene:
    """What Mitsuba is told of a scene; lampyris reads the scene file."""

    def __init__(self, file, model, index, receiver, half, fine, lumens=None):
        self.file, self.model, self.index, self.fine = file, model, index, fine
        self.receiver, self.half = receiver, half  # plane z, half sides; without a plane half angles in degrees
        self.lumens = lumens  # of a far field


FAR_CELLS = 120, 90
PLANE_CELLS = 200, 200


SCENES = {
    "s1": Scene("s1_lens", "lens_planoconvex_nurbs", 1.5168, 107.026853, (20.0, 20.0), 5e-5),
    "s2": Scene("s2_lamp", "lamp_multicavity", 1.4906, 25000.0, (10000.0, 10000.0), 4.2e-4),
    "s3": Scene("s3_reflector", "reflector_freeform_trimmed", 1.0, 1000.0, (1000.0, 1000.0), 1.4e-4),
    "demo": Scene("demo", "lamp_multicavity", 1.4906, None, (6.0, 4.5), 1e-3, 300.0),
}


def read_ply(path):
    """Vertices (position, normal), triangles, and face and part of each triangle."""
    import numpy as np

    head, body = Path(path).read_bytes().split(b"end_header\n", 1)
    counts = [int(line.split()[2]) for line in head.split(b"\n") if line.startswith(b"element")]
    vertices = np.frombuffer(body, "<f8", counts[0] * 8).reshape(counts[0], 8)
    at, triangles, owner = counts[0] * 64, [], []
    for _ in range(counts[1]):
        n = body[at]
        corners = struct.unpack_from(f"<{n}I", body, at + 1)
        face = struct.unpack_from("<II", body, at + 1 + 4 * n)
        at += 17 + 4 * n
        for k in range(n - 2):
            triangles.append((corners[0], corners[k + 1], corners[k + 2]))
            owner.append(face)
    return vertices, np.array(triangles), np.array(owner)


def groups_of(name, vertices, triangles, owner):
    """Which triangles are mirror, dielectric and black."""
    import numpy as np

    if name == "s1":
        return {"dielectric": np.ones(len(triangles), bool)}
    face, part = owner[:, 0], owner[:, 1]
    mirror = np.zeros(len(triangles), bool)
    if name in ("s2", "demo"):
        for k in np.unique(face[part == 0]):
            x, y, z = vertices[triangles[face == k].ravel(), :3].T
            on = [np.abs(((x - xc) ** 2 + y**2) / (4 * f) - z).max() < 1e-3 for xc, f in PARABOLOIDS]
            mirror |= (face == k) & any(on)
        cover = part == 1
        return {"mirror": mirror, "dielectric": cover, "black": ~(mirror | cover)}
    middle = vertices[triangles, :3].mean(axis=1)
    nearest = np.argmin(((middle - (40.0, 20.0, 18.377825)) ** 2).sum(1))
    mirror = face == face[nearest]
    return {"mirror": mirror, "black": ~mirror}


def trace(peer, seed, n):
    """The loop itself; `dr` and `mi` are global, as `dr.syntax` takes every local name for state of the loop."""
    scene, pointer, receiver, half, index = peer.world, peer.pointer, peer.scene.receiver, peer.scene.half, peer.scene.index
    cells = PLANE_CELLS if receiver is not None else FAR_CELLS
    F, U, B = mi.Float, mi.UInt32, mi.Bool
    rng = mi.PCG32(size=n, initstate=seed)
    origin, direction = peer.emit(rng, n)
    ray = mi.Ray3f(origin, direction)
    weight, active = dr.full(F, 1.0, n), dr.full(B, True, n)
    bounce, segments = dr.zeros(U, n), dr.zeros(U, n)
    grid = dr.zeros(F, cells[0] * cells[1])
    x_end, y_end, end = dr.zeros(F, n), dr.zeros(F, n), dr.zeros(F, n)
    while active:
        if dr.hint(receiver is not None, mode="scalar"):
            t = (receiver - ray.o.z) / ray.d.z
            x, y = dr.fma(ray.d.x, t, ray.o.x), dr.fma(ray.d.y, t, ray.o.y)
            ahead = t > 0
        else:
            # Light that escapes is counted by direction: H and V of type A, degrees.
            t = dr.full(F, dr.inf, 1)
            x, y = dr.rad2deg(dr.atan2(ray.d.x, ray.d.z)), dr.rad2deg(dr.asin(ray.d.y))
            ahead = ray.d.z > 0
        meets = ahead & (abs(x) <= half[0]) & (abs(y) <= half[1])
        ray.maxt = dr.select(meets, t, dr.largest(F))
        si = scene.ray_intersect(ray, mi.RayFlags.Minimal | mi.RayFlags.ShadingFrame, False, active)
        segments += dr.select(active, U(1), U(0))
        hit, received = active & si.is_valid(), active & ~si.is_valid() & meets
        if dr.hint(peer.interactions is not None, mode="scalar"):
            received &= bounce == U(peer.interactions)
        x_end, y_end = dr.select(received, x, x_end), dr.select(received, y, y_end)
        end = dr.select(received, weight, end)
        i = U(dr.clip((x / half[0] + 1) * (cells[0] / 2), 0, cells[0] - 1))
        j = U(dr.clip((y / half[1] + 1) * (cells[1] / 2), 0, cells[1] - 1))
        dr.scatter_reduce(dr.ReduceOp.Add, grid, weight, j * cells[0] + i, received)
        normal = si.sh_frame.n
        cos_i = -dr.dot(ray.d, normal)
        going, on = ray.d, dr.full(B, False, 1)
        if dr.hint("mirror" in pointer, mode="scalar"):
            mirror = hit & (si.shape == pointer["mirror"])
            going = dr.select(mirror, ray.d + 2 * cos_i * normal, going)
            weight = dr.select(mirror, weight * 0.95, weight)
            on = mirror
        if dr.hint("dielectric" in pointer, mode="scalar"):
            glass = hit & (si.shape == pointer["dielectric"])
            share, cos_t, _, eta = mi.fresnel(cos_i, F(index))
            back = ray.d + 2 * cos_i * normal
            through = eta * ray.d + (eta * cos_i + cos_t) * normal
            going = dr.select(glass, dr.select(rng.next_float32() < share, back, through), going)
            on = on | glass
        bounce += 1
        ray = dr.select(hit, si.spawn_ray(dr.normalize(going)), ray)
        active = on & (bounce < 1000)
    return grid, x_end, y_end, end, segments


class Mitsuba:
    """A scene in Mitsuba, with a loop that does what it asks for and nothing else."""

    def __init__(self, name, ply, threads, interactions=None):
        """Counts all light, or only what met so many surfaces."""
        import numpy as np

        self.interactions = interactions
        mi.set_variant("llvm_ad_rgb")
        dr.set_thread_count(threads)
        self.name, self.scene = name, SCENES[name]
        vertices, triangles, owner = read_ply(ply)
        self.triangles = len(triangles)
        shapes = {"type": "scene"}
        for group, which in groups_of(name, vertices, triangles, owner).items():
            used, corners = np.unique(triangles[which].ravel(), return_inverse=True)
            mesh = mi.Mesh(group, len(used), int(which.sum()), has_vertex_normals=True)
            p = mi.traverse(mesh)
            p["vertex_positions"] = np.ascontiguousarray(vertices[used, 0:3].astype(np.float32).ravel())
            p["vertex_normals"] = np.ascontiguousarray(vertices[used, 3:6].astype(np.float32).ravel())
            p["faces"] = np.ascontiguousarray(corners.astype(np.uint32).ravel())
            p.update()
            shapes[group] = mesh
        self.world = mi.load_dict(shapes)
        self.pointer = {s.id(): mi.ShapePtr(s) for s in self.world.shapes()}
        self.loop = dr.syntax(trace)

    def emit(self, rng, n):
        F, V = mi.Float, mi.Vector3f
        if self.name == "s1":
            r = 15 * dr.sqrt(rng.next_float32())
            s, c = dr.sincos(2 * dr.pi * rng.next_float32())
            return mi.Point3f(r * c, r * s, F(-10)), V(0, 0, 1) + dr.zeros(V, n)
        if self.name == "s3":
            z = 1 - 2 * rng.next_float32()
            s, c = dr.sincos(2 * dr.pi * rng.next_float32())
            r = dr.sqrt(dr.maximum(0, 1 - z * z))
            return mi.Point3f(0, 0, 26) + dr.zeros(V, n), V(r * c, r * s, z)
        led = dr.arange(mi.UInt32, n) % 3
        pick = lambda values: dr.select(led == 0, F(values[0]), dr.select(led == 1, F(values[1]), F(values[2])))
        half = math.sqrt(0.5)
        normal = V(F(0), pick((0, -half, 0)), pick((-1, -half, -1)))
        across = V(F(1), F(0), F(0))
        other = dr.cross(normal, across)
        a, b = rng.next_float32() - 0.5, rng.next_float32() - 0.5
        origin = mi.Point3f(pick([x for x, _ in PARABOLOIDS]), F(0), pick([f for _, f in PARABOLOIDS]))
        u = rng.next_float32()
        s, c = dr.sincos(2 * dr.pi * rng.next_float32())
        sine = dr.sqrt(u)
        return origin + 0.31 * normal + across * a + other * b, across * (sine * c) + other * (sine * s) + normal * dr.sqrt(1 - u)

    def run(self, seed, rays):
        """Seconds, power received, RMS along x and y, segments a ray, peak candela of a far field."""
        start = time.perf_counter()
        grid, x, y, w, segments = self.loop(self, dr.opaque(mi.UInt64, seed), rays)
        power, xx, yy, n = dr.sum(w), dr.sum(w * x * x), dr.sum(w * y * y), dr.sum(mi.Float64(segments))
        dr.eval(grid, power, xx, yy, n)
        dr.sync_thread()
        seconds = time.perf_counter() - start
        return seconds, power[0] / rays, [math.sqrt(xx[0] / power[0]), math.sqrt(yy[0] / power[0])], n[0] / rays, self.peak(grid, rays)

    def peak(self, grid, rays):
        if self.scene.lumens is None:
            return None
        columns, lines = FAR_CELLS
        wide, high = (math.radians(2 * half / cells) for half, cells in zip(self.scene.half, FAR_CELLS))
        best = 0.0
        for j, line in enumerate(grid.numpy().reshape(lines, columns)):
            low = math.radians(-self.scene.half[1]) + j * high
            best = max(best, float(line.max()) / (wide * (math.sin(low + high) - math.sin(low))))
        return best * self.scene.lumens / rays


def lampyris(program, scene, options, folder, seed):
    """The same of ours, with the share of the time that is not tracing left out."""
    line = [program, "trace", str(FIXTURES / "scenes" / f"{scene.file}.toml"), "--json", "-q", "-o", folder, "--seed", str(seed)]
    line += ["--rays", str(options.rays), "--threads", str(options.threads), "--tolerance", str(options.tolerance_now)]
    out = json.loads(subprocess.run(line, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True).stdout)
    receiver = out["receivers"][-1]
    return out["seconds"]["trace"], receiver["power"], receiver["rms"], out["segments"] / out["rays"], receiver["figures"]["max"]["value"]


def row(seconds, last, rays):
    """Figures of one program on one scene."""
    rate = sorted(rays / s / 1e6 for s in seconds)
    p = lambda share: rate[min(len(rate) - 1, int(share * len(rate)))]
    return {
        "mrays_per_s": {"median": p(0.5), "least": rate[0], "best": rate[-1], "p10": p(0.1), "p90": p(0.9)},
        "seconds": seconds,
        "power": last[1],
        "rms": last[2],
        "segments_per_ray": last[3],
        "peak_candela": last[4],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the lampyris command")
    parser.add_argument("--scenes", default="s1,s2,s3")
    parser.add_argument("--tolerance", default="0.1", help="mm, or 'fine' for about a million facets")
    parser.add_argument("--rays", type=lambda n: int(float(n)), default=2_000_000)
    parser.add_argument("--threads", type=int, default=4)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("-o", "--output")
    options = parser.parse_args()
    global dr, mi
    try:
        import drjit as dr
        import mitsuba as mi

        mi.set_variant("llvm_ad_rgb")
        dr.eval(mi.Float(1.0) + 1.0)
    except Exception as reason:  # whatever is missing, there is nothing to compare with
        print(f"skipped: Mitsuba cannot run here ({reason})", file=sys.stderr)
        return 0
    result = {"peer": f"mitsuba {mi.__version__}", "threads": options.threads, "rays": options.rays, "scenes": {}}
    for name in options.scenes.split(","):
        scene = SCENES[name]
        options.tolerance_now = scene.fine if options.tolerance == "fine" else float(options.tolerance)
        with tempfile.TemporaryDirectory() as folder:
            ply = os.path.join(folder, "facets.ply")
            line = [options.program, "facet", str(FIXTURES / "step" / f"{scene.model}.stp"), "-o", ply, "-q"]
            subprocess.run(line + ["--tolerance", str(options.tolerance_now)], stdout=subprocess.DEVNULL, check=False)
            peer = Mitsuba(name, ply, options.threads)
            os.remove(ply)
            turns = {
                "lampyris": lambda seed: lampyris(options.program, scene, options, os.path.join(folder, "out"), seed),
                "mitsuba": lambda seed: peer.run(seed, options.rays),
            }
            seconds, last = {k: [] for k in turns}, {k: turns[k](1) for k in turns}  # the first of each is not counted
            for k in range(options.rounds):
                for who in sorted(turns, reverse=k % 2 == 1):
                    last[who] = turns[who](2 + k)
                    seconds[who].append(last[who][0])
        rows = {who: row(seconds[who], last[who], options.rays) for who in turns}
        pairs = sorted(b / a for a, b in zip(seconds["lampyris"], seconds["mitsuba"]))
        ratio = {"median_of_pairs": pairs[len(pairs) // 2], "least": pairs[0], "most": pairs[-1]}
        ratio["of_best"] = min(seconds["mitsuba"]) / min(seconds["lampyris"])
        result["scenes"][name] = {"tolerance_mm": options.tolerance_now, "triangles": peer.triangles, **rows, "lampyris_over_mitsuba": ratio}
        rate = {who: rows[who]["mrays_per_s"] for who in rows}
        print(
            f"{name}  {peer.triangles} triangles  lampyris {rate['lampyris']['median']:.2f} (best {rate['lampyris']['best']:.2f})"
            f"  mitsuba {rate['mitsuba']['median']:.2f} (best {rate['mitsuba']['best']:.2f}) Mrays/s"
            + (f"  peak {last['lampyris'][4]:.0f} and {last['mitsuba'][4]:.0f} cd" if scene.lumens else "")
            + f"  ratio {ratio['median_of_pairs']:.2f} ({ratio['least']:.2f}-{ratio['most']:.2f})"
        )
    if options.output:
        Path(options.output).write_text(json.dumps(result, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
