"""Intersectors on arrays: closed forms, and what a wrong array is told."""

from __future__ import annotations

import pathlib
from typing import Any

import numpy as np
import pytest
from conftest import ROOT

import lampyris as lp

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
SIDES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def cube() -> lp.Mesh:
    return lp.Mesh.from_arrays(CUBE, SIDES)


def rays(n: int, seed: int = 1) -> tuple[Any, Any]:
    random = np.random.default_rng(seed)
    origins = random.normal(size=(n, 3))
    origins *= 5.0 / np.linalg.norm(origins, axis=1)[:, None]
    targets = random.uniform(-1.5, 1.5, size=(n, 3))
    directions = targets - origins
    return origins, directions / np.linalg.norm(directions, axis=1)[:, None]


def slab(origins: Any, directions: Any) -> Any:
    """Distance to the cube by the slab method."""
    near, far = ((side - origins) / directions for side in (-1.0, 1.0))
    enter, leave = np.minimum(near, far).max(axis=1), np.maximum(near, far).min(axis=1)
    return np.where(enter <= leave, enter, np.inf)


@pytest.mark.parametrize("build", [lp.Octree, lp.Bvh, lambda m: lp.Bvh(m, wide=False)])
def test_a_cube_is_met_where_its_slabs_say(build: Any) -> None:
    origins, directions = rays(20_000)
    hits = build(cube()).intersect(origins, directions)
    expected = slab(origins, directions)
    assert np.array_equal(np.isfinite(hits.t), np.isfinite(expected))
    met = np.isfinite(expected)
    assert np.abs(hits.t[met] - expected[met]).max() < 1e-12
    points = origins[met] + expected[met][:, None] * directions[met]
    side = np.abs(points).argmax(axis=1)
    normals = np.zeros_like(points)
    normals[np.arange(len(points)), side] = np.sign(points[np.arange(len(points)), side])
    assert np.abs(hits.normal[met] - normals).max() < 1e-12
    assert (hits.face[~met] == -1).all() and np.isnan(hits.normal[~met]).all() and (hits.certainty[~met] == 0).all()
    assert hits.t.dtype == np.float64 and hits.normal.shape == (20_000, 3) and hits.uv.shape == (20_000, 2)


def test_arrays_in_one_piece_are_read_where_they_lie_and_no_other_is_changed() -> None:
    origins, directions = rays(1000)
    tree = lp.Octree(cube())
    expected = tree.intersect(origins, directions).t
    origins.flags.writeable = False
    directions.flags.writeable = False
    assert np.array_equal(tree.intersect(origins, directions).t, expected)
    strided = np.zeros((1000, 6))
    strided[:, ::2] = origins
    assert np.array_equal(tree.intersect(strided[:, ::2], directions).t, expected)
    assert np.array_equal(tree.intersect(origins.tolist(), directions).t, expected)
    # As in packed records, whose fields stand at any byte.
    unaligned = np.frombuffer(b"x" + origins.tobytes(), dtype=np.float64, offset=1).reshape(-1, 3)
    assert not unaligned.flags.aligned and np.array_equal(tree.intersect(unaligned, directions).t, expected)
    assert np.allclose(tree.intersect(origins.astype(np.float32), directions).t, expected, atol=1e-5, equal_nan=True)
    assert np.allclose(tree.intersect(origins, 3.0 * directions).t, expected, atol=1e-12, equal_nan=True)
    for threads in (1, 3):
        assert np.array_equal(tree.intersect(origins, directions, threads=threads).t, expected)
    assert tree.intersect(np.empty((0, 3)), np.empty((0, 3))).t.shape == (0,)
    near = tree.intersect(origins, directions, t_max=1.0)
    assert not np.isfinite(near.t).any()


@pytest.mark.parametrize(
    ("origins", "directions", "kind", "says"),
    [
        (np.zeros((3, 2)), np.ones((3, 3)), ValueError, r"origins: the shape must be \(n, 3\)"),
        (np.zeros(3), np.ones((1, 3)), ValueError, r"a single row is origins\[None, :\]"),
        (np.zeros((2, 3)), np.ones((3, 3)), ValueError, "the same number of rows, not 2 and 3"),
        (np.array([["a", "b", "c"]]), np.ones((1, 3)), TypeError, "float64"),
        (np.zeros((1, 3), dtype=complex), np.ones((1, 3)), TypeError, "float64"),
        (np.array([[object()] * 3]), np.ones((1, 3)), TypeError, "float64"),
        (np.array([[0, 0, 0], [0, np.nan, 0]]), np.ones((2, 3)), ValueError, r"ray 1 from .* cannot be traced: every number must be finite"),
        (np.zeros((1, 3)), np.array([[0, 0, np.inf]]), ValueError, "cannot be traced: every number must be finite"),
        (np.zeros((1, 3)), np.zeros((1, 3)), ValueError, "the direction has no length"),
        (np.full((1, 3), 1e16), np.ones((1, 3)), ValueError, "more than 1e15 mm away"),
        (np.zeros((3, 4)), np.ones((3, 4)), ValueError, "exchanged by origins.T"),
        (np.zeros((2, 2, 3)), np.ones((4, 3)), ValueError, r"origins.reshape\(-1, 3\)"),
        ([[0, 0, 0], [1]], np.ones((2, 3)), ValueError, r"origins: an array of shape \(n, 3\) is needed"),
        (np.zeros((1, 3)), None, TypeError, "directions: an array of float64"),
    ],
)
def test_wrong_rays_are_told_what_to_do(origins: Any, directions: Any, kind: type[Exception], says: str) -> None:
    with pytest.raises(kind, match=says):
        lp.Octree(cube()).intersect(origins, directions)


@pytest.mark.parametrize("length", [5e-324, 1e-310, 1e-160, 1e-20, 3.0, 1e160, 1e308])
def test_directions_of_any_length_mean_the_same(length: float) -> None:
    origins, directions = np.array([[0.25, 0.5, -5.0]]), np.array([[0.0, 0.0, length]])
    for tracer in (lp.Octree(cube()), lp.Bvh(cube())):
        assert tracer.intersect(origins, directions).t.tolist() == [4.0]


def test_normals_without_a_length_are_those_of_the_facet() -> None:
    # A square in x = 2 whose points have no normals, as those of a mesh that nobody gave any.
    points = np.array([[2.0, 0, 0], [2, 1, 0], [2, 1, 1], [2, 0, 1]])
    mesh = lp.Mesh.from_arrays(points, [[0, 1, 2, 3]], np.zeros((4, 3)))
    hits = lp.Octree(mesh).intersect([[0, 0.5, 0.25]], [[1, 0, 0]])
    assert hits.t.tolist() == [2.0] and np.abs(hits.normal[0]).tolist() == [1.0, 0.0, 0.0]


def test_wrong_threads_and_ranges_are_told_what_to_do() -> None:
    tree, ray = lp.Octree(cube()), np.array([[0.0, 0.0, -5.0]])
    wrong: list[tuple[dict[str, Any], type[Exception], str]] = [
        ({"threads": 0}, ValueError, "threads = 0"),
        ({"threads": -1}, ValueError, "threads = -1"),
        ({"threads": 2.5}, ValueError, "threads = 2.5"),
        ({"threads": "all"}, TypeError, "threads: a whole number"),
        ({"t_min": 5.0, "t_max": 1.0}, ValueError, "t_min = 5 must be at most t_max = 1"),
        ({"t_max": "far"}, TypeError, "t_max: a number"),
    ]
    for keys, kind, says in wrong:
        with pytest.raises(kind, match=says):
            tree.intersect(ray, np.array([[0.0, 0.0, 1.0]]), **keys)
    # More threads than a machine has stop none.
    assert tree.intersect(ray, np.array([[0.0, 0.0, 1.0]]), threads=10**9).t.tolist() == [4.0]


def test_wrong_meshes_are_told_what_to_do() -> None:
    with pytest.raises(ValueError, match="number of one of the 8 positions"):
        lp.Mesh.from_arrays(CUBE, [[0, 1, 8]])
    with pytest.raises(ValueError, match=r"positions\[1, 2\] is NaN"):
        lp.Mesh.from_arrays(np.array([[0, 0, 0], [0, 0, np.nan]]), np.array([[0, 1, 1]]))
    normals = np.ones((6, 4, 3))
    normals[2, 3, 1] = np.nan
    with pytest.raises(ValueError, match=r"normals\[2, 3, 1\] is nan: every normal must be finite"):
        lp.Mesh.from_arrays(CUBE, SIDES, normals)
    with pytest.raises(TypeError, match="takes a Mesh"):
        lp.Octree(CUBE)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="normals round"):
        lp.Octree(cube(), normals="round")
    with pytest.raises(ValueError, match="give model="):
        lp.Octree(cube(), normals="exact")
    with pytest.raises(ValueError, match=r"the shape must be \(n, 3\) or \(n, 4\)"):
        lp.Mesh.from_arrays(CUBE, np.zeros((2, 5), dtype=int))
    with pytest.raises(ValueError, match="check the unit of length"):
        lp.Mesh.from_arrays(1e13 * CUBE, SIDES)
    for take in (lp.Mesh.from_trimesh, lp.Mesh.from_pyvista):
        with pytest.raises(TypeError, match="arrays go to Mesh.from_arrays"):
            take(CUBE)


def test_hits_are_moved_to_no_other_model(lens: pathlib.Path) -> None:
    model, again = lp.read_step(lens), lp.read_step(lens)
    with pytest.raises(ValueError, match="stands for no spline"):
        lp.Octree(cube(), normals="exact", model=model)
    with pytest.raises(ValueError, match="not of this model"):
        lp.Octree(model.tessellate(), normals="exact", model=again)
    with pytest.raises(TypeError, match="model: a Model is needed"):
        lp.Bvh(model.tessellate(), normals="exact", model=str(lens))  # type: ignore[arg-type]


def test_hits_that_are_moved_to_the_spline_are_those_of_the_spline(lens: pathlib.Path) -> None:
    model = lp.read_step(lens)
    mesh = model.tessellate(0.05)
    random = np.random.default_rng(3)
    origins = np.column_stack([random.uniform(-8, 8, (500, 2)), np.full(500, -50.0)])
    directions = np.tile([0.0, 0.0, 1.0], (500, 1))
    exact = lp.Exact(model).intersect(origins, directions)
    polished = lp.Octree(mesh, normals="exact", model=model).intersect(origins, directions)
    assert np.isfinite(exact.t).all() and (exact.certainty == 3).all()
    assert np.abs(polished.t - exact.t).max() < 1e-9
    facets = lp.Octree(mesh).intersect(origins, directions)
    assert np.abs(facets.t - exact.t).max() < 0.05 + 1e-9


def test_meshes_go_to_trimesh_and_pyvista_and_back(lens: pathlib.Path, tmp_path: pathlib.Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    pyvista = pytest.importorskip("pyvista")
    mesh = lp.read_step(lens).tessellate((0.05, 0.2))
    as_trimesh = mesh.to_trimesh()
    assert as_trimesh.is_watertight and abs(as_trimesh.volume - mesh.volume) < 1e-6 * mesh.volume
    assert abs(mesh.to_pyvista().area - mesh.area) < 1e-3 * mesh.area
    ball = trimesh.creation.icosphere(subdivisions=3, radius=2.0)
    other = pyvista.Sphere(radius=2.0)
    for made in (lp.Mesh.from_trimesh(ball), lp.Mesh.from_pyvista(other)):
        hits = lp.Octree(made).intersect([[0.1, 0.2, -9.0]], [[0.0, 0.0, 1.0]])
        assert abs(hits.t[0] - (9.0 - np.sqrt(4.0 - 0.05))) < 0.05
    mesh.save(tmp_path / "lens.stl")
    assert (tmp_path / "lens.stl").stat().st_size > 84
    with pytest.raises(OSError, match="lens.xyz"):
        mesh.save(tmp_path / "lens.xyz")


def rays_onto(mesh: lp.Mesh, n: int = 5000) -> tuple[Any, Any]:
    """Rays from around a mesh to points in its box."""
    random = np.random.default_rng(11)
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    origins = (low + high) / 2 + np.linalg.norm(high - low) * random.normal(size=(n, 3))
    return origins, random.uniform(low, high, (n, 3)) - origins


NAMES = ("t", "normal", "geometric_normal", "face", "primitive", "uv", "certainty")


@pytest.mark.parametrize("normals", ["flat", "bilinear", "cubic"])
def test_a_mesh_is_the_same_after_its_way_through_pyvista(normals: str) -> None:
    pytest.importorskip("pyvista")
    mesh = lp.read_step(ROOT / "fixtures" / "step" / "reflector_freeform_trimmed.stp").tessellate(0.5)
    quads = mesh.facets[:, 2] != mesh.facets[:, 3]
    assert quads.any() and not quads.all()
    back = lp.Mesh.from_pyvista(mesh.to_pyvista())
    assert np.array_equal(back.facets, mesh.facets) and back.area == mesh.area
    for name in ("positions", "normals", "uv", "face", "sag"):
        assert np.array_equal(getattr(back, name), getattr(mesh, name)), name
    given, again = (lp.Octree(m, normals).intersect(*rays_onto(mesh)) for m in (mesh, back))
    assert np.isfinite(given.t).sum() > 1000
    assert all(np.array_equal(getattr(given, name), getattr(again, name), equal_nan=True) for name in NAMES)


def test_normals_of_points_that_moved_are_not_kept() -> None:
    pyvista = pytest.importorskip("pyvista")
    trimesh = pytest.importorskip("trimesh")
    # Normals 45° off those of the facets.
    mesh = lp.Mesh.from_arrays(CUBE, SIDES, np.tile([1.0, 1.0, 0.0], (6, 4, 1)), face=[0, 0, 0, 4, 4, 2])
    assert mesh.face.tolist() == [0, 0, 0, 4, 4, 2] and np.allclose(mesh.normals, [0.5**0.5, 0.5**0.5, 0])
    ray = (np.array([[0.2, 0.3, -5.0]]), np.array([[0.0, 0.0, 1.0]]))
    kept = (lp.Mesh.from_pyvista(mesh.to_pyvista()), lp.Mesh.from_trimesh(mesh.to_trimesh()))
    for same in kept:
        hits = lp.Octree(same).intersect(*ray)
        assert hits.t.tolist() == [4.0] and hits.face.tolist() == [4]
        assert np.allclose(hits.normal, [[0.5**0.5, 0.5**0.5, 0]])
    moved = mesh.to_pyvista().rotate_x(30)
    turned = mesh.to_trimesh()
    turned.apply_transform(trimesh.transformations.rotation_matrix(0.5, [1, 0, 0]))
    for take, other in ((lp.Mesh.from_pyvista, moved), (lp.Mesh.from_trimesh, turned)):
        with pytest.warns(UserWarning, match="points or cells are not those"):
            assert np.abs(take(other).normals - [0.5**0.5, 0.5**0.5, 0]).max() > 0.1
    # Those that PyVista has at its points are taken.
    ball = pyvista.Sphere(radius=2.0)
    hits = lp.Octree(lp.Mesh.from_pyvista(ball)).intersect([[0.3, 0.4, -9.0]], [[0.0, 0.0, 1.0]])
    point = np.array([0.3, 0.4, -9.0 + hits.t[0]])
    assert np.degrees(np.arccos(hits.normal[0] @ point / np.linalg.norm(point))) < 0.2


def test_trimesh_has_the_triangles_that_are_traced() -> None:
    pytest.importorskip("trimesh")
    mesh = lp.read_step(ROOT / "fixtures" / "step" / "reflector_freeform_trimmed.stp").tessellate(0.5)
    back = lp.Mesh.from_trimesh(mesh.to_trimesh())
    assert len(back) == len(mesh.triangles) and back.area == pytest.approx(mesh.area, rel=1e-12)
    given, again = (lp.Octree(m, "flat").intersect(*rays_onto(mesh)) for m in (mesh, back))
    assert np.isfinite(given.t).sum() > 1000 and np.allclose(given.t, again.t, rtol=0, atol=1e-11)
    assert (given.face == again.face).mean() > 0.999
    # Every corner has the normal that the mesh has there on that face, and inside of a triangle they are weighed by the areas opposite.
    assert corners(back) == corners(mesh)
    origins, directions = rays_onto(mesh)
    hits = lp.Octree(back).intersect(origins, directions)
    met = np.isfinite(hits.t)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    points = (origins + np.where(met, hits.t, 0)[:, None] * directions)[met]
    triangle = back.positions[back.facets[hits.primitive[met]]][:, :3]
    opposite = np.cross(triangle[:, [1, 2, 0]] - points[:, None], triangle[:, [2, 0, 1]] - points[:, None])
    weights = np.linalg.norm(opposite, axis=2)
    expected = (weights[:, :, None] * back.normals[hits.primitive[met]][:, :3]).sum(axis=1)
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    assert np.abs(hits.normal[met] - expected).max() < 1e-9


def corners(mesh: lp.Mesh) -> set[tuple[float, ...]]:
    """Face, point and normal of every corner."""
    face = np.repeat(mesh.face, 4)[:, None]
    return set(map(tuple, np.hstack([face, mesh.facets.reshape(-1, 1), mesh.normals.reshape(-1, 3)]).tolist()))


def test_polygons_of_pyvista_are_facets() -> None:
    pyvista = pytest.importorskip("pyvista")
    points = np.array([[0, 0, 0], [2, 0, 0], [3, 1, 0], [2, 2, 0], [0, 2, 0], [5, 0, 0], [5, 2, 0], [9, 9, 0.0]])
    # A line before them, a pentagon, a quad whose diagonal counts, a triangle.
    mesh = pyvista.PolyData(points, [5, 0, 1, 2, 3, 4, 4, 1, 5, 6, 2, 3, 2, 6, 3], lines=[2, 0, 7])
    made = lp.Mesh.from_pyvista(mesh)
    assert len(made) == 5 and made.area == pytest.approx(mesh.area) and [1, 5, 6, 2] in made.facets.tolist()
    strip = pyvista.PolyData(points[:4], strips=[4, 0, 1, 3, 2])
    assert len(lp.Mesh.from_pyvista(strip)) == 2
    assert len(lp.Mesh.from_pyvista(pyvista.Cube())) == 6
    for empty in (pyvista.PolyData(), pyvista.Line(), pyvista.PolyData(points)):
        with pytest.raises(ValueError, match="has no polygons"):
            lp.Mesh.from_pyvista(empty)


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({"normals": np.zeros((6, 4, 2))}, r"shape \(6, 4, 3\) are needed for the corners"),
        ({"normals": np.full((6, 4, 3), np.nan)}, "must be finite"),
        ({"face": [0, 1, 0, 2, 3, 4]}, "stand together"),
        ({"face": [0, 1, 2]}, "face: there must be 6, one a facet, not 3"),
        ({"face": [0.5] * 6}, "whole numbers"),
        ({"face": [-1] * 6}, "whole numbers"),
    ],
)
def test_wrong_corners_and_faces_are_told_what_to_do(keys: Any, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        lp.Mesh.from_arrays(CUBE, SIDES, **keys)
