"""Meshes of quad facets, and those of trimesh and PyVista."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _lampyris
from ._types import FloatArray, Path


class Mesh:
    """Quad facets with normals at their corners; a triangle is a quad whose last two corners coincide."""

    def __init__(self, core: _lampyris.Mesh) -> None:
        self._core = core

    @classmethod
    def from_arrays(
        cls, positions: npt.ArrayLike, facets: npt.ArrayLike, normals: npt.ArrayLike | None = None
    ) -> Mesh:
        """From points (n, 3) in mm and the corners of triangles (m, 3) or quads (m, 4).

        ``normals`` (n, 3) are those of the surface at the points; without, and where one has no length, that of the flat facet is taken.
        """
        return cls(_lampyris.Mesh.from_arrays(positions, facets, normals))

    @classmethod
    def from_trimesh(cls, mesh: Any) -> Mesh:
        """From a ``trimesh.Trimesh``, with its normals at the vertices."""
        if not all(hasattr(mesh, name) for name in ("vertices", "faces", "vertex_normals")):
            raise TypeError(f"from_trimesh takes a trimesh.Trimesh, not {type(mesh).__name__}; arrays go to Mesh.from_arrays")
        return cls.from_arrays(mesh.vertices, mesh.faces, mesh.vertex_normals)

    @classmethod
    def from_pyvista(cls, mesh: Any) -> Mesh:
        """From a ``pyvista.PolyData``; faces of more than three corners become triangles."""
        if not all(hasattr(mesh, name) for name in ("triangulate", "faces", "points")):
            advice = "extract_surface() makes one of a grid; arrays go to Mesh.from_arrays"
            raise TypeError(f"from_pyvista takes a pyvista.PolyData, not {type(mesh).__name__}; {advice}")
        surface = mesh.triangulate()
        facets = surface.faces.reshape(-1, 4)[:, 1:]
        return cls.from_arrays(np.asarray(surface.points, dtype=float), facets)

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
        self._core.save(path)

    def to_trimesh(self) -> Any:
        """As a ``trimesh.Trimesh`` of triangles."""
        import trimesh

        return trimesh.Trimesh(self.positions, self.triangles.astype(np.int64), process=False)

    def to_pyvista(self) -> Any:
        """As a ``pyvista.PolyData`` of quads and triangles, with ``face`` and ``sag`` of every facet."""
        import pyvista

        quads = self.facets
        is_triangle = quads[:, 2] == quads[:, 3]
        counts = np.where(is_triangle, 3, 4)
        cells = np.concatenate([np.r_[n, row[:n]] for n, row in zip(counts, quads)]) if len(quads) else counts
        mesh = pyvista.PolyData(self.positions, cells.astype(np.int64))
        mesh.cell_data["face"] = self.face
        if len(self.sag):
            mesh.cell_data["sag_mm"] = self.sag
        return mesh

    def __len__(self) -> int:
        return len(self._core)

    def __repr__(self) -> str:
        return repr(self._core)
