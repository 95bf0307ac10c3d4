"""Meshes of quad facets, and those of trimesh and PyVista."""

from __future__ import annotations

import hashlib
import json
import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _lampyris
from ._types import FloatArray, Path
from .errors import writable_file

#: Under what the hash of points and facets stands in meshes of others: what holds for other points, as their normals, is told by it.
GEOMETRY_KEY = "lampyris_geometry"


class Mesh:
    """Quad facets with normals at their corners; a triangle is a quad whose last two corners coincide.

    Its arrays are made anew whenever they are asked for: what is written into them does not change the mesh.
    """

    def __init__(self, core: _lampyris.Mesh) -> None:
        if not isinstance(core, _lampyris.Mesh):
            raise TypeError("a Mesh is made by lampyris.Mesh.from_arrays(points, facets) or by tessellating a model, not by its name")
        self._core = core

    @classmethod
    def from_arrays(
        cls,
        positions: npt.ArrayLike,
        facets: npt.ArrayLike,
        normals: npt.ArrayLike | None = None,
        *,
        face: npt.ArrayLike | None = None,
    ) -> Mesh:
        """From points (n, 3) in mm and the corners of triangles (m, 3) or quads (m, 4); a quad is traced as two triangles, along its first
        diagonal.

        ``normals`` are those of the surface at the points (n, 3), or at the corners of every facet (m, 4, 3) as :attr:`normals` gives them;
        without, and where one has no length, that of the flat facet is taken. ``face`` (m,) says of which face a facet is, those of one
        together; without, each is one of its own.
        """
        if normals is not None and np.ndim(normals) == 3:
            corners = _corners("normals", normals, len(np.asarray(facets)))
            return cls(_lampyris.Mesh.from_arrays(positions, facets, None, corners, _face_numbers(face)))
        return cls(_lampyris.Mesh.from_arrays(positions, facets, normals, None, _face_numbers(face)))

    @classmethod
    def from_trimesh(cls, mesh: Any) -> Mesh:
        """From a ``trimesh.Trimesh``, with its normals at the vertices.

        Of one that :meth:`to_trimesh` made, and whose points and triangles are as they were, faces and the normals at the corners of every
        triangle are taken.
        """
        if not all(hasattr(mesh, name) for name in ("vertices", "faces", "face_attributes", "metadata")):
            raise TypeError(f"from_trimesh takes a trimesh.Trimesh, not {type(mesh).__name__}; arrays go to Mesh.from_arrays")
        kept = mesh.face_attributes
        if "corner_normals" in kept and _is_unchanged(mesh.metadata.get(GEOMETRY_KEY), mesh.vertices, mesh.faces):
            # A triangle is a quad whose last corner stands twice.
            normals = np.asarray(kept["corner_normals"])[:, [0, 1, 2, 2]]
            return cls.from_arrays(mesh.vertices, mesh.faces, normals, face=kept["face"])
        return cls.from_arrays(mesh.vertices, mesh.faces, mesh.vertex_normals)

    @classmethod
    def from_pyvista(cls, mesh: Any) -> Mesh:
        """From a ``pyvista.PolyData`` with its normals at the points, where it has any; polygons of more than four corners become triangles.

        Of one that :meth:`to_pyvista` made, and whose points and cells are as they were, faces, normals, parameters and proved distances
        are taken: it is the same mesh. ``ValueError`` for one without polygons.
        """
        if not all(hasattr(mesh, name) for name in ("triangulate", "faces", "points", "cell_data", "field_data")):
            advice = "extract_surface() makes one of a grid; arrays go to Mesh.from_arrays"
            raise TypeError(f"from_pyvista takes a pyvista.PolyData, not {type(mesh).__name__}; {advice}")
        points, (facets, cells) = np.asarray(mesh.points, dtype=float), _facets_of_pyvista(mesh)
        if len(facets) == 0:
            raise ValueError("from_pyvista: this PolyData has no polygons; extract_surface() or delaunay_2d() makes some")
        data, stated = mesh.cell_data, mesh.field_data.get(GEOMETRY_KEY)
        if "corner_normals" in data and _is_unchanged(None if stated is None else str(stated[0]), points, facets):
            normals, uv = (np.asarray(data[name])[cells] for name in ("corner_normals", "corner_uv"))
            corners = np.concatenate([normals.reshape(-1, 3), uv.reshape(-1, 2)], axis=1)
            sag = np.asarray(data["sag_mm"])[cells].tolist() if "sag_mm" in data else None
            return cls(_lampyris.Mesh.from_arrays(points, facets, None, corners, np.asarray(data["face"])[cells].tolist(), sag))
        return cls.from_arrays(points, facets, mesh.point_data.active_normals)

    @property
    def positions(self) -> FloatArray:
        """Distinct points, mm, (n, 3)."""
        return self._core.positions

    @property
    def facets(self) -> npt.NDArray[np.uint32]:
        """Positions of the corners of every facet, (m, 4)."""
        return self._core.facets

    @property
    def triangles(self) -> npt.NDArray[np.uint32]:
        """The triangles that are traced, (k, 3): two a quad, along its first diagonal."""
        quads = self.facets
        second = quads[quads[:, 2] != quads[:, 3]]
        return np.concatenate([quads[:, :3], second[:, [0, 2, 3]]])

    @property
    def normals(self) -> FloatArray:
        """Normals at the corners of every facet, (m, 4, 3)."""
        return self._core.normals

    @property
    def uv(self) -> FloatArray:
        """Parameters of the corners on the face's surface, (m, 4, 2)."""
        return self._core.uv

    @property
    def face(self) -> npt.NDArray[np.uint32]:
        """The placed face of every facet, (m,)."""
        return self._core.face

    @property
    def sag(self) -> FloatArray:
        """Proved distance of every facet from the spline, mm; infinite where there is no proof, empty without a spline."""
        return self._core.sag

    @property
    def area(self) -> float:
        """Area as traced, mm²."""
        return self._core.area

    @property
    def volume(self) -> float:
        """Enclosed volume, mm³; meaningful for a closed mesh alone."""
        return self._core.volume

    @property
    def report(self) -> dict[str, Any] | None:
        """The mesher's account, as ``lampyris facet --json``; none for a mesh that was given."""
        text = self._core.report_json()
        return None if text is None else dict(json.loads(text))

    def save(self, path: Path) -> None:
        """Writes .obj, .stl, .ply, .vtu, .glb or .data2, by the extension."""
        self._core.save(writable_file(path))

    def to_trimesh(self) -> Any:
        """As a ``trimesh.Trimesh`` of the triangles that are traced, with ``face`` and ``corner_normals`` (k, 3, 3) as face attributes.

        Quads are split along the diagonal that is traced, so that :meth:`from_trimesh` gives the same distances; normals are interpolated
        in each triangle then instead of over the quad, and parameters, proved distances and the report are lost.
        """
        import trimesh

        quads, triangles = self.facets, self.triangles
        second = quads[:, 2] != quads[:, 3]
        normals, face = self.normals, self.face
        attributes = {
            "face": np.concatenate([face, face[second]]),
            "corner_normals": np.concatenate([normals[:, :3], normals[second][:, [0, 2, 3]]]),
        }
        # Facets of a face stand together.
        order = np.argsort(attributes["face"], kind="stable")
        triangles, points = triangles[order].astype(np.int64), self.positions
        return trimesh.Trimesh(
            points,
            triangles,
            process=False,
            face_attributes={name: values[order] for name, values in attributes.items()},
            metadata={GEOMETRY_KEY: _hash_of_geometry(points, triangles)},
        )

    def to_pyvista(self) -> Any:
        """As a ``pyvista.PolyData`` of quads and triangles.

        Its cell data are ``face``, ``sag_mm``, and ``corner_normals`` and ``corner_uv``, the normals and parameters of the four corners in
        a row: :meth:`from_pyvista` makes the same mesh of it, but for the report.
        """
        import pyvista

        quads, points = self.facets, self.positions
        used = np.ones((len(quads), 5), dtype=bool)
        used[:, 4] = quads[:, 2] != quads[:, 3]
        cells = np.column_stack([used.sum(axis=1) - 1, quads.astype(np.int64)])[used]
        mesh = pyvista.PolyData(points, cells) if len(quads) else pyvista.PolyData()
        mesh.cell_data["face"] = self.face
        mesh.cell_data["corner_normals"] = self.normals.reshape(-1, 12)
        mesh.cell_data["corner_uv"] = self.uv.reshape(-1, 8)
        if len(self.sag):
            mesh.cell_data["sag_mm"] = self.sag
        mesh.field_data[GEOMETRY_KEY] = [_hash_of_geometry(points, quads)]
        return mesh

    def __reduce__(self) -> tuple[Any, ...]:
        corners = np.concatenate([self.normals.reshape(-1, 3), self.uv.reshape(-1, 2)], axis=1)
        sag = self.sag.tolist() or None
        return _mesh_of, (self.positions, self.facets, None, corners, self.face.tolist(), sag, self._core.report_json())

    def __deepcopy__(self, _memo: dict[int, Any]) -> Mesh:
        # Nothing of it can be changed.
        return self

    def __len__(self) -> int:
        return len(self._core)

    def __repr__(self) -> str:
        return repr(self._core)


def _mesh_of(*arrays: Any) -> Mesh:
    return Mesh(_lampyris.Mesh.from_arrays(*arrays))


def _corners(name: str, normals: npt.ArrayLike, facets: int) -> FloatArray:
    """Normals of corners (m, 4, 3), or (m, 3, 3) of triangles, as rows of a normal and two parameters, which are zero."""
    given = np.asarray(normals)
    if given.shape == (facets, 3, 3):
        given = given[:, [0, 1, 2, 2]]
    if given.shape != (facets, 4, 3) or given.dtype.kind not in "fiu":
        raise ValueError(f"{name}: numbers of shape ({facets}, 4, 3) are needed for the corners, or (n, 3) for the points, not {given.shape}")
    if not np.isfinite(given).all():
        facet, corner, axis = np.argwhere(~np.isfinite(given))[0].tolist()
        raise ValueError(f"{name}[{facet}, {corner}, {axis}] is {given[facet, corner, axis]}: every normal must be finite; a zero one is the facet's own")
    return np.pad(given.reshape(-1, 3).astype(float), ((0, 0), (0, 2)))


def _face_numbers(face: npt.ArrayLike | None) -> list[int] | None:
    if face is None:
        return None
    given = np.asarray(face)
    if given.dtype.kind not in "iu" or given.ndim != 1 or (given.size and not 0 <= given.min() <= given.max() < 2**31):
        raise ValueError("face: whole numbers of shape (m,) are needed, from 0 to 2147483647")
    return list(given.tolist())


def _hash_of_geometry(points: npt.ArrayLike, facets: npt.ArrayLike) -> str:
    """The hash of points and the corners of facets."""
    pieces = (np.ascontiguousarray(points, dtype=np.float64), np.ascontiguousarray(facets, dtype=np.int64))
    return hashlib.sha256(b"".join(piece.tobytes() for piece in pieces)).hexdigest()


def _is_unchanged(stated: str | None, points: npt.ArrayLike, facets: npt.ArrayLike) -> bool:
    """Whether points and facets are those whose hash is stated; warns where they are others."""
    if stated == _hash_of_geometry(points, facets):
        return True
    warnings.warn("points or cells are not those that lampyris gave: its faces and the normals of corners are left out", stacklevel=3)
    return False


def _facets_of_pyvista(mesh: Any) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """The corners of the polygons of a PolyData, (m, 4), of triangles the last one twice; and the cells that they are of."""
    import pyvista

    # Cells of points and lines come before those of polygons, strips after.
    before = mesh.n_verts + mesh.n_lines
    if mesh.n_strips:
        strips = pyvista.PolyData(mesh.points, strips=mesh.strips).triangulate()
        polygons = np.concatenate([mesh.faces, strips.faces])
        mesh = pyvista.PolyData(mesh.points, polygons)
    starts, corners = [], mesh.faces.tolist()
    place = 0
    while place < len(corners):
        starts.append(place)
        place += corners[place] + 1
    first, faces = np.array(starts, dtype=np.int64), np.asarray(mesh.faces, dtype=np.int64)
    counts = faces[first] if len(first) else first
    cells = np.arange(len(first)) + before
    small = (counts == 3) | (counts == 4)
    places = first[small, None] + np.column_stack([np.tile([1, 2, 3], (small.sum(), 1)), counts[small]])
    facets, cells_of = faces[places], cells[small]
    large = np.flatnonzero(counts > 4)
    if len(large):
        polygons = np.concatenate([faces[first[k] : first[k] + counts[k] + 1] for k in large])
        whole = pyvista.PolyData(mesh.points, polygons)
        whole.cell_data["cell"] = cells[large]
        split = whole.triangulate()
        triangles = split.faces.reshape(-1, 4)[:, [1, 2, 3, 3]]
        facets, cells_of = np.concatenate([facets, triangles]), np.concatenate([cells_of, split.cell_data["cell"]])
        # In the order of the cells, as they stand.
        order = np.argsort(cells_of, kind="stable")
        facets, cells_of = facets[order], cells_of[order]
    return facets, cells_of
