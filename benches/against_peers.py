#!/usr/bin/env python3
"""Seconds to the same answer beside Mitsuba 3, Raysect, pvtrace and optiland: the spot of S1 and S3, in turns.

    python benches/against_peers.py target/release/lampyris -o RESULT.json        # with mitsuba, raysect, pvtrace, rtree, optiland from PyPI
    ... --rays 100000 --rounds 5 --threads 4 --scenes s1,s3 --who lampyris,mitsuba

The answer is the RMS size of the spot: S1, light that passed both faces of the lens, radius 0.800607 mm in closed form; S3, light that
met the mirror once, 81.3350 and 37.0787 mm by quadrature on the spline. Each contender gets the facets that keep it within 1 % of that (the
tolerance stands in `FACETS`), which `lampyris facet` writes beforehand without being timed; lampyris itself reads the STEP file and
chooses by itself, optiland has the lens by its radii. `answer` is from the start of the process to the figure, imports and compilation included;
`trace` is the tracing alone, warm. Contenders that take longer than a minute get fewer rays, and their times are scaled to all of them: `scaled`
says so. What is not within 1 % is marked and has no time to the answer. Whoever is missing is named and skipped.
"""
import argparse
import json
import math
import os
import platform
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import against_mitsuba
from against_mitsuba import FIXTURES, read_ply

MODELS = {"s1": "lens_planoconvex_nurbs", "s3": "reflector_freeform_trimmed"}
FILES = {"s1": "s1_lens", "s3": "s3_reflector"}
INTERACTIONS = {"s1": 2, "s3": 1}
RECEIVER_MM = {"s1": 107.026853, "s3": 1000.0}
TRUTH = {"s1": [0.800607], "s3": [81.3350, 37.0787]}
WITHIN = 0.01
# Tolerance of the facets, mm: pvtrace has flat normals only.
FACETS = {"mitsuba": 0.01, "raysect": 0.01, "pvtrace": 0.001}
SHARE = {"raysect": 1, "pvtrace": 200}  # of the rays, one in so many is traced
GLASS, MIRROR = 1.5168, 0.95
START_OFFSET = 1e-4  # mm: Raysect keeps positions in f32 and meets the facet that it leaves again


def spot(scene, points):
    """RMS about the axis of points (x, y, weight), as the scene's truth counts it."""
    weight = sum(w for _, _, w in points)
    xx, yy = (math.sqrt(sum(w * p * p for p, w in zip(axis, (w for _, _, w in points))) / weight) for axis in zip(*((x, y) for x, y, _ in points)))
    return [math.hypot(xx, yy)] if scene == "s1" else [xx, yy]


def emitted(scene, rng):
    """Origin and direction of a ray."""
    if scene == "s1":
        r, phi = 15 * math.sqrt(rng.random()), 2 * math.pi * rng.random()
        return (r * math.cos(phi), r * math.sin(phi), -10.0), (0.0, 0.0, 1.0)
    z, phi = 1 - 2 * rng.random(), 2 * math.pi * rng.random()
    r = math.sqrt(max(0.0, 1 - z * z))
    return (0.0, 0.0, 26.0), (r * math.cos(phi), r * math.sin(phi), z)


def landed(scene, origin, direction):
    """Where a ray meets the receiver's plane."""
    t = (RECEIVER_MM[scene] - origin[2]) / direction[2] if direction[2] else -1.0
    return (origin[0] + t * direction[0], origin[1] + t * direction[1]) if t > 0 else None


# ---- contenders: each gives (rays traced, spot, seconds of tracing) for a seed --------------------------------------------------------


def lampyris(options):
    with tempfile.TemporaryDirectory() as folder:
        text = (FIXTURES / "scenes" / f"{FILES[options.scene]}.toml").read_text().replace("../step", str(FIXTURES / "step"))
        Path(folder, "scene.toml").write_text(f"{text}interactions = {INTERACTIONS[options.scene]}\n")
        line = [options.program, "trace", "scene.toml", "--json", "-q", "--no-report", "--rays", str(options.rays), "--threads", str(options.threads)]
        out = json.loads(subprocess.run([*line, "--seed", str(options.seed)], cwd=folder, stdout=subprocess.PIPE, check=True).stdout)
    x, y = out["receivers"][0]["rms"]
    return options.rays, [math.hypot(x, y)] if options.scene == "s1" else [x, y], out["seconds"]["trace"]


def mitsuba(options):
    import drjit
    import mitsuba

    mitsuba.set_variant("llvm_ad_rgb")
    against_mitsuba.dr, against_mitsuba.mi = drjit, mitsuba
    peer = against_mitsuba.Mitsuba(options.scene, options.ply, options.threads, INTERACTIONS[options.scene])
    _, _, (x, y), *_ = peer.run(options.seed, options.rays)
    answered = time.time()
    warm = peer.run(options.seed + 1000, options.rays)[0]
    return options.rays, [math.hypot(x, y)] if options.scene == "s1" else [x, y], warm, answered


def in_processes(worker, options):
    """Traces with a process a thread; `worker(options, rays, seed)` gives points."""
    import multiprocessing

    rays = options.rays // SHARE[options.who]
    start = time.perf_counter()
    with multiprocessing.get_context("fork").Pool(options.threads) as pool:
        tasks = [(options, rays // options.threads, 1000 * options.seed + k) for k in range(options.threads)]
        points = [p for part in pool.starmap(worker, tasks) for p in part]
    return rays, spot(options.scene, points), time.perf_counter() - start


def raysect_points(options, rays, seed):
    from raysect.core import Point3D, Ray, Vector3D

    world, mirror = options.world
    rng, points = random.Random(seed), []
    for _ in range(rays):
        origin, direction = emitted(options.scene, rng)
        origin, direction, weight = Point3D(*origin), Vector3D(*direction), 1.0
        for met in range(8):
            hit = world.hit(Ray(origin, direction))
            if hit is None:
                place = landed(options.scene, origin, direction) if met == INTERACTIONS[options.scene] else None
                if place and weight:
                    points.append((*place, weight))
                break
            origin = hit.hit_point.transform(hit.primitive_to_world)
            normal = hit.normal.transform(hit.primitive_to_world).normalise()
            cos_i = -direction.dot(normal)
            if options.scene == "s3":
                if hit.primitive is not mirror:
                    break
                weight *= MIRROR
                direction = (direction + normal * (2 * cos_i)).normalise()
            else:
                # Schlick's law would do; these are Fresnel's for unpolarised light.
                side = 1.0 if cos_i > 0 else -1.0
                eta = 1 / GLASS if cos_i > 0 else GLASS
                c = abs(cos_i)
                sine = eta * eta * (1 - c * c)
                if sine >= 1:
                    break
                d = math.sqrt(1 - sine)
                s, p = (eta * c - d) / (eta * c + d), (c - eta * d) / (c + eta * d)
                if rng.random() < (s * s + p * p) / 2:
                    break  # reflected: no longer light that passed both faces alone
                direction = (direction * eta + normal * (side * (eta * c - d))).normalise()
            origin = origin + direction * START_OFFSET
    return points


def raysect(options):
    import numpy as np
    from raysect.core import World
    from raysect.primitive import Mesh

    world, parts, mirror = World(), {}, None
    vertices, triangles, owner = read_ply(options.ply)
    groups = against_mitsuba.groups_of(options.scene, vertices, triangles, owner)
    for group, which in groups.items():
        used, corners = np.unique(triangles[which].ravel(), return_inverse=True)
        corners = corners.reshape(-1, 3)
        parts[group] = Mesh(
            vertices[used, :3].astype(np.float32), np.hstack([corners, corners]).astype(np.int32), vertices[used, 3:6].astype(np.float32),
            smoothing=True, closed=False, parent=world,
        )
    options.world = world, parts.get("mirror")
    # The accelerator is built by the first ray.
    raysect_points(options, 1, 0)
    return in_processes(raysect_points, options)


def pvtrace_points(options, rays, seed):
    import numpy as np
    from pvtrace.algorithm import photon_tracer
    from pvtrace.light.event import Event
    from pvtrace.light.ray import Ray

    np.random.seed(seed % 2**32)
    rng, points = random.Random(seed), []
    for _ in range(rays):
        origin, direction = emitted(options.scene, rng)
        try:
            path = photon_tracer.follow(options.world, Ray(position=origin, direction=direction, wavelength=555))
        except Exception:  # a share of its rays ends in one; they are lost
            continue
        if [event for _, event in path].count(Event.TRANSMIT) == 2 and not any(event == Event.REFLECT for _, event in path):
            last = [ray for ray, event in path if event == Event.TRANSMIT][-1]
            place = landed(options.scene, last.position, last.direction)
            if place:
                points.append((*place, 1.0))
    return points


def pvtrace(options):
    if options.scene != "s1":
        raise ImportError("mirrors on some faces of a mesh are not to be had")
    import numpy as np
    import trimesh

    np.float, np.int, np.bool = float, int, bool  # its last release uses names that numpy has dropped
    from pvtrace import Material, Mesh, Node, Scene, Sphere

    vertices, triangles, _ = read_ply(options.ply)
    solid = trimesh.Trimesh(vertices[:, :3], triangles)
    middle = tuple(solid.center_mass)
    world = Node(name="world", geometry=Sphere(radius=500.0, material=Material(refractive_index=1.0)))
    lens = Node(name="lens", geometry=Mesh(trimesh=solid, material=Material(refractive_index=GLASS)), parent=world)
    lens.translate(middle)
    options.world = Scene(world)
    return in_processes(pvtrace_points, options)


def optiland(options):
    if options.scene != "s1":
        raise ImportError("sequential: it reads no surface of a file")
    import numpy as np
    from optiland.materials import IdealMaterial
    from optiland.optic import Optic

    np.random.seed(options.seed)
    optic = Optic()
    optic.add_surface(index=0, thickness=np.inf)
    optic.add_surface(index=1, thickness=7.026853199395113, radius=np.inf, is_stop=True, material=IdealMaterial(n=GLASS))
    optic.add_surface(index=2, thickness=100.0, radius=-51.68)
    optic.add_surface(index=3)
    optic.set_aperture(aperture_type="EPD", value=30)
    optic.set_field_type(field_type="angle")
    optic.add_field(y=0)
    optic.add_wavelength(value=0.55, is_primary=True)

    def traced():
        start = time.perf_counter()
        rays = optic.trace(Hx=0, Hy=0, wavelength=0.55, num_rays=options.rays, distribution="random")
        return float(np.sqrt(np.mean(np.square(rays.x) + np.square(rays.y)))), time.perf_counter() - start

    radius, _ = traced()
    answered = time.time()
    return options.rays, [radius], traced()[1], answered


CONTENDERS = {f.__name__: f for f in (lampyris, mitsuba, raysect, pvtrace, optiland)}


def answer(options):
    """What a process of one contender prints."""
    traced, figures, seconds, *answered = CONTENDERS[options.who](options)
    print(json.dumps({"traced": traced, "spot": figures, "trace": seconds, "answered": answered[0] if answered else time.time()}))


def ask(who, scene, ply, seed, options):
    line = [sys.executable, __file__, options.program, "--answer", who, "--scenes", scene, "--ply", str(ply), "--seed", str(seed)]
    line += ["--rays", str(options.rays), "--threads", str(options.threads)]
    start = time.time()
    done = subprocess.run(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        return {"skipped": done.stderr.strip().splitlines()[-1][-200:] if done.stderr.strip() else "no reason"}
    found = json.loads(done.stdout.splitlines()[-1])
    scale = options.rays / found["traced"]
    error = max(abs(a / b - 1) for a, b in zip(found["spot"], TRUTH[scene]))
    overhead = found["answered"] - start - found["trace"] if scale > 1 else 0.0
    total = overhead + scale * found["trace"] if scale > 1 else found["answered"] - start
    return {"answer": total, "trace": scale * found["trace"], "scaled": scale > 1, "spot": found["spot"], "error": error}


def compare(scene, folder, options):
    """All rounds of a scene: the contenders in turn, each round from another one on."""
    rows = {who: [] for who in options.who.split(",")}
    plys = {}
    for tolerance in {FACETS[who] for who in rows if who in FACETS}:
        ply = Path(folder, f"{scene}-{tolerance}.ply")
        line = [options.program, "facet", str(FIXTURES / "step" / f"{MODELS[scene]}.stp"), "-o", ply, "-q", "--tolerance", str(tolerance)]
        subprocess.run(line, stdout=subprocess.DEVNULL, check=False)
        plys[tolerance] = ply
    for k in range(options.rounds):
        turn = list(rows)[k % len(rows) :] + list(rows)[: k % len(rows)]
        for who in turn:
            if not any("skipped" in row for row in rows[who]):
                rows[who].append(ask(who, scene, plys.get(FACETS.get(who)), 1 + k, options))
    result = {}
    for who, rounds in rows.items():
        if "skipped" in rounds[-1]:
            print(f"{scene} {who}: skipped: {rounds[-1]['skipped']}")
            continue
        middle = {key: sorted(r[key] for r in rounds)[len(rounds) // 2] for key in ("answer", "trace", "error")}
        result[who] = {**middle, "scaled": rounds[0]["scaled"], "rounds": rounds}
        note = ("" if middle["error"] <= WITHIN else "  NOT THE SAME ANSWER") + ("  (scaled)" if rounds[0]["scaled"] else "")
        print(f"{scene} {who}: answer {middle['answer']:.2f} s, tracing {middle['trace']:.3f} s, spot off by {100 * middle['error']:.2f} %{note}", flush=True)
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the lampyris command")
    parser.add_argument("--scenes", default="s1,s3")
    parser.add_argument("--who", default=",".join(CONTENDERS))
    parser.add_argument("--rays", type=lambda n: int(float(n)), default=100_000)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("-o", "--output")
    for option in ("--answer", "--ply"):
        parser.add_argument(option, help=argparse.SUPPRESS)
    parser.add_argument("--seed", type=int, default=1, help=argparse.SUPPRESS)
    options = parser.parse_args()
    options.program = str(Path(options.program).resolve())
    if options.answer:
        options.who, options.scene = options.answer, options.scenes
        return answer(options)
    from importlib import metadata

    versions = {}
    for who in options.who.split(","):
        try:
            versions[who] = metadata.version(who)
        except metadata.PackageNotFoundError:
            versions[who] = None
    versions["lampyris"] = subprocess.run([options.program, "--version"], capture_output=True, text=True).stdout.strip()
    named = [line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name")]
    result = {"versions": versions, "processor": (named or [platform.processor()])[0], "threads": options.threads, "rays": options.rays, "scenes": {}}
    with tempfile.TemporaryDirectory() as folder:
        for scene in options.scenes.split(","):
            result["scenes"][scene] = compare(scene, folder, options)
    if options.output:
        Path(options.output).write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
