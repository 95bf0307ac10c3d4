"""What a run counted: arrays with unit and both errors."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from . import _html, _lampyris
from ._types import FloatArray, Path
from .errors import write_file
from .settings import real_number
from .stored import Cells, StoredCells, StoredResults
from .verdicts import Assessment

#: Pixels across a picture of a receiver, at least.
PICTURE_WIDTH = 200


@dataclass(frozen=True)
class Figure:
    """A figure with both its errors, one standard error each."""

    #: In :attr:`unit`.
    value: float
    #: Unit of the value and of both errors.
    unit: str
    #: From the number of rays.
    statistical: float
    #: From the facets and lost light; of lost light alone on the spline, none where it was not measured.
    geometric: float | None
    #: ``statistics`` or ``geometry``: the larger of the two.
    limited_by: str

    @classmethod
    def from_document(cls, figure: dict[str, Any]) -> Figure:
        """From its object in ``results.json``."""
        return cls(*(figure[key] for key in ("value", "unit", "statistical", "geometric", "limited_by")))

    def __str__(self) -> str:
        geometric = "not measured" if self.geometric is None else f"{self.geometric:.2g}"
        return f"{self.value:.6g} ± {self.statistical:.2g} (rays) ± {geometric} (facets) {self.unit}".strip()

    def __float__(self) -> float:
        return self.value


class Receiver:
    """What one receiver counted. Maps have the shape (cells[1], cells[0]): the second axis runs down the rows."""

    def __init__(self, results: Cells, index: int, document: dict[str, Any]) -> None:
        self._results = results
        self._index = index
        #: The object of the receiver in ``results.json``.
        self.document = document
        #: Its name in the scene.
        self.name: str = document["name"]
        #: ``plane``, ``disc``, ``far_field``, ``sphere`` or ``absorbed``.
        self.kind: str = document["kind"]
        #: Unit of the cells.
        self.unit: str = document["unit"]
        #: ``power``, ``max``, ``rms_1``, ``rms_2``, ``centroid_1``, ``centroid_2``; places are absent where no light came,
        #: and along an angle that goes all around.
        self.figures: dict[str, Figure] = {
            name: Figure.from_document(f) for name, f in document["figures"].items() if isinstance(f, dict)
        }
        #: Totals of the further channels by name.
        self.channel_totals: dict[str, Figure] = {
            f["name"]: Figure.from_document(f) for f in document["figures"].get("channels") or ()
        }

    @cached_property
    def _layers(self) -> tuple[FloatArray, FloatArray, FloatArray | None]:
        layers = self._results.layers(self._index)
        # One array for all who ask: what one writes the others would read.
        for layer in layers:
            if layer is not None:
                layer.setflags(write=False)
        return layers

    @property
    def values(self) -> FloatArray:
        """The cells, in :attr:`unit`."""
        return self._layers[0]

    @property
    def statistical(self) -> FloatArray:
        """Standard error of every cell from the number of rays."""
        return self._layers[1]

    @property
    def geometric(self) -> FloatArray | None:
        """Error of every cell from the facets; zero on the spline, none where it was not measured."""
        return self._layers[2]

    @cached_property
    def edges(self) -> tuple[FloatArray, FloatArray]:
        """Edges of the cells along both axes: mm of planes and discs, degrees of angles."""
        edges = self._results.edges(self._index)
        # Kept for all who ask, as the cells are.
        for along in edges:
            along.setflags(write=False)
        return edges

    @property
    def axes(self) -> tuple[FloatArray, FloatArray]:
        """Centres of the cells along both axes."""
        first, second = self.edges
        return 0.5 * (first[1:] + first[:-1]), 0.5 * (second[1:] + second[:-1])

    @property
    def axis_names(self) -> tuple[str, str]:
        """What runs along the axes, as dimensions of ``to_xarray``."""
        if self.kind == "absorbed":
            # One cell for all faces.
            return "column", "row"
        if self.kind in ("plane", "disc"):
            return "x", "y"
        return ("C", "gamma") if self.document.get("angles") == "C" else ("H", "V")

    def _in(self, unit: str) -> FloatArray:
        if self.unit != unit:
            raise ValueError(f"{self.name} is in {self.unit}, not {unit}; ``values`` has it in its own unit")
        return self.values

    @property
    def candela(self) -> FloatArray:
        """Luminous intensity, of a far field in a run that counts lm."""
        return self._in("cd")

    @property
    def lux(self) -> FloatArray:
        """Illuminance, of a plane, disc or sphere in a run that counts lm."""
        return self._in("lx")

    @property
    def power(self) -> Figure:
        """Power that arrived."""
        return self.figures["power"]

    @property
    def channels(self) -> dict[str, tuple[FloatArray, FloatArray]]:
        """Further channels by name: cells and their standard errors."""
        names = [c["name"] for c in self.document["channels"]]
        return {name: self._results.channel(self._index, k) for k, name in enumerate(names)}

    def to_xarray(self) -> Any:
        """An ``xarray.Dataset`` of value, statistical and geometric over the axes."""
        import xarray

        first, second = self.axis_names
        along, across = self.axes
        layers = {"value": self.values, "statistical": self.statistical}
        if self.geometric is not None:
            layers["geometric"] = self.geometric
        unit = "mm" if self.kind in ("plane", "disc") else "deg"
        data = {name: ((second, first), layer, {"units": self.unit}) for name, layer in layers.items()}
        coordinates = {first: (first, along, {"units": unit}), second: (second, across, {"units": unit})}
        return xarray.Dataset(data, coordinates, {"receiver": self.name, "kind": self.kind})

    def to_png(self, exponent: float = 0.5) -> bytes:
        """The map as a picture; an exponent below 1 lifts what is dark."""
        zoom = max(1, -(-PICTURE_WIDTH // self.values.shape[1]))
        return _lampyris.value_map(self.values, zoom, real_number("exponent", exponent))

    def __reduce__(self) -> tuple[Any, ...]:
        return Receiver, (StoredCells(self._results, {self._index: self.document}), self._index, self.document)

    def __deepcopy__(self, memo: dict[int, Any]) -> Receiver:
        return Receiver(self._results, self._index, copy.deepcopy(self.document, memo))

    def __repr__(self) -> str:
        return f"<lampyris receiver {self.name!r} ({self.kind}): {self.power}>"

    def _repr_html_(self) -> str:
        rows = [(n, f.value, f.statistical, f.geometric, f.unit) for n, f in self.figures.items()]
        text = _html.table((self.name, "value", "± rays", "± facets", "unit"), rows)
        if self.values.size > 1:
            text += _html.picture(self.to_png(), f"{self.name}, 0 to {np.nanmax(self.values):.4g} {self.unit}")
        return text


class Ends:
    """Where the rays of lists ended: arrays with a row for each ray, and one more for each part that an interface split off it."""

    def __init__(self, numbers: tuple[Any, ...], places: tuple[FloatArray, ...], words: list[tuple[int, str]]) -> None:
        #: The source, by its place in the scene.
        self.source: Any
        #: The ray, by its place in the list.
        self.ray: Any
        #: Which part of a ray that was split; 0 for one that was not.
        self.branch: Any
        #: The placed face where it ended; -1 where it was at none.
        self.face: Any
        #: Hits before.
        self.bounces: Any
        self.source, self.ray, self.branch, codes, self.face, self.bounces = numbers
        table = np.full(256, "", dtype=f"<U{max((len(word) for _, word in words), default=1)}")
        for code, word in words:
            table[code] = word
        #: How it ended, in the words of ``lampyris trace --ends``: ``received``, ``absorbed``, ``escaped``, ``lost`` …
        self.event = table[codes]
        #: Where, mm, (n, 3); of light that left the scene a point on its way.
        self.point: FloatArray
        #: Unit directions in which they came there, (n, 3).
        self.direction: FloatArray
        #: Power that came there, in the unit of the run.
        self.power: FloatArray
        self.point, self.direction, self.power = places

    def to_frame(self) -> Any:
        """A ``pandas.DataFrame`` with the columns of ``lampyris trace --ends FILE.csv``."""
        import pandas

        columns = {name: getattr(self, name) for name in ("source", "ray", "branch", "event", "face", "bounces")}
        columns |= dict(zip(("x_mm", "y_mm", "z_mm"), self.point.T)) | dict(zip(("dx", "dy", "dz"), self.direction.T))
        return pandas.DataFrame({**columns, "power": self.power})

    def __len__(self) -> int:
        return len(self.power)

    def __repr__(self) -> str:
        words, counts = np.unique(self.event, return_counts=True)
        return f"<lampyris.Ends: {', '.join(f'{n} {word}' for word, n in zip(words, counts)) or 'none'}>"


class Run(Mapping[str, Receiver]):
    """The results of a traced scene; a mapping of receivers by name.

    It can be pickled: figures, arrays and verdicts are kept, and the scene is not, so that :meth:`assess` comes before.
    """

    def __init__(self, results: _lampyris.Results | StoredResults, until: dict[str, Any] | None = None) -> None:
        self._results = results
        #: What came of an error that was asked for.
        self.until = until

    @cached_property
    def document(self) -> dict[str, Any]:
        """The document of ``results.json``; what is changed in it the run tells too, so change a ``copy.deepcopy`` of it."""
        return dict(json.loads(self._results.document_json()))

    @cached_property
    def _receivers(self) -> dict[str, Receiver]:
        documents = self.document["receivers"]
        return {d["name"]: Receiver(self._results, k, d) for k, d in enumerate(documents)}

    @property
    def digest(self) -> str:
        """Hash of the sums and counts behind the figures, not of sequences, paths or the list of lost rays: runs whose sums agree bit for
        bit have the same, that of ``lampyris trace --json``."""
        return self._results.digest

    @property
    def rays(self) -> int:
        """Rays that left the sources."""
        return int(self.document["rays"])

    @property
    def power(self) -> dict[str, float]:
        """Where the power went, in :attr:`unit`: emitted, received, absorbed, escaped, cut_off, lost."""
        return dict(self.document["power"])

    @property
    def unit(self) -> str:
        """Unit of :attr:`power`: ``W`` or ``lm``."""
        return str(self.document["power_figures"]["received"]["unit"])

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds of reading, meshing, building, tracing and checking."""
        return dict(self.document["seconds"])

    @property
    def notes(self) -> list[str]:
        """What a reader must know, first what the models lack: faces that were refused or have no facets, and what could not be read."""
        return [*self._results.model_notes(), *self.document["notes"]]

    @property
    def chosen(self) -> dict[str, Any] | None:
        """How the run is traced and why, where nobody asked for it."""
        return self.document.get("chosen")

    @property
    def check(self) -> dict[str, Any] | None:
        """The cross-check of some of the rays on BVH and spline."""
        return self.document.get("check")

    @property
    def faces(self) -> list[dict[str, Any]]:
        """The faces that absorbed and let out most, as many as ``Scene(faces=N)`` asked for; empty where it did not.

        Each has ``face``, its number among the placed faces as hits have it, ``selector``, which means it in a rule of a scene
        (``part = "led", entity = 12``), ``absorbed``, ``entered`` and ``left``, these with ``…_error`` and ``…_geometric``.
        """
        return list((self.document.get("faces") or {"first": []})["first"])

    def faces_to_frame(self) -> Any:
        """A ``pandas.DataFrame`` of :attr:`faces`."""
        import pandas

        return pandas.DataFrame(self.faces)

    @property
    def verdicts(self) -> list[Assessment]:
        """The verdicts of the scene's own ``[[regulation]]`` tables, in their order; empty where it names none.

        Raises ``SceneError`` where a far field cannot be judged.
        """
        return [Assessment(verdict) for verdict in json.loads(self._results.verdicts_json())]

    @property
    def paths(self) -> dict[str, Any]:
        """Recorded paths vertex by vertex: arrays ``ray``, ``branch``, ``bounce``, ``point`` (n, 3) in mm and ``power``."""
        return dict(zip(("ray", "branch", "bounce", "point", "power"), self._results.paths()))

    def paths_to_pyvista(self) -> Any:
        """Recorded paths as a ``pyvista.PolyData`` of lines, with ``power`` at their points, to be shown beside the facets."""
        import pyvista

        paths = self.paths
        starts = np.flatnonzero(np.r_[True, np.diff(paths["ray"]) != 0] | np.r_[True, np.diff(paths["branch"].astype(int)) != 0])
        ends = np.r_[starts[1:], len(paths["ray"])]
        lines = [np.r_[end - start, np.arange(start, end)] for start, end in zip(starts, ends) if end - start > 1]
        mesh = pyvista.PolyData(paths["point"], lines=np.concatenate(lines) if lines else None)
        mesh.point_data["power"] = paths["power"]
        return mesh

    def assess(
        self, regulation: str, receiver: str | None = None, *, left_hand: bool = False, as_placed: bool = False
    ) -> Assessment:
        """The verdict of a lamp regulation (see :func:`lampyris.regulations`) about a far field in candela."""
        if isinstance(self._results, StoredResults):
            raise ValueError("assess: a run that was pickled is without its scene; assess it before, or trace the scene again")
        names = list(self._receivers)
        if receiver is None:
            fits = [n for n, r in self._receivers.items() if r.kind == "far_field" and r.unit == "cd"]
            if len(fits) != 1:
                raise ValueError(f"assess: name the far field in candela, one of {fits or names}")
            receiver = fits[0]
        elif receiver not in self._receivers:
            raise KeyError(f"no receiver {receiver!r}; there are {', '.join(names)}")
        text = _lampyris.assess(self._results, names.index(receiver), regulation, left_hand, as_placed)
        return Assessment(json.loads(text))

    def to_json(self, path: Path | None = None) -> str:
        """The document as text, written to a file where one is named."""
        text = json.dumps(self.document, indent=2)
        if path is not None:
            write_file(path, text + "\n")
        return text

    def to_frame(self) -> Any:
        """A ``pandas.DataFrame`` of all figures: receiver, figure, value, statistical, geometric, unit."""
        import pandas

        rows = [
            {"receiver": name, "figure": figure, "value": f.value, "statistical": f.statistical, "geometric": f.geometric, "unit": f.unit}
            for name, receiver in self._receivers.items()
            for figure, f in receiver.figures.items()
        ]
        return pandas.DataFrame(rows)

    def __getitem__(self, name: str) -> Receiver:
        try:
            return self._receivers[name]
        except KeyError:
            raise KeyError(f"no receiver {name!r}; there are {', '.join(self._receivers)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._receivers)

    def __len__(self) -> int:
        return len(self._receivers)

    def __reduce__(self) -> tuple[Any, ...]:
        kept = self._results
        return Run, (kept if isinstance(kept, StoredResults) else StoredResults(kept), self.until)

    def __deepcopy__(self, memo: dict[int, Any]) -> Run:
        return Run(self._results, copy.deepcopy(self.until, memo))

    def __repr__(self) -> str:
        receivers = f"receivers {', '.join(self)}" if len(self) else "no receivers"
        return f"<lampyris.Run: {self.rays} rays, {receivers}, digest {self.digest}>"

    def _repr_html_(self) -> str:
        errors, figures = self.document["power_errors"], self.document.get("power_figures", {})
        rows = [
            (name, value, errors.get(name), figures.get(name, {}).get("geometric"), self.unit)
            for name, value in self.power.items()
        ]
        power = _html.table(("power", "value", "± rays", "± facets", "unit"), rows)
        return power + "".join(receiver._repr_html_() for receiver in self.values())


class LostLightWarning(UserWarning):
    """More light was lost than a sound scene loses; a filter of warnings that raises it leaves the results in ``run``."""

    def __init__(self, sentence: str, run: Run) -> None:
        super().__init__(sentence)
        #: The results.
        self.run = run

    def __reduce__(self) -> tuple[Any, ...]:
        return LostLightWarning, (str(self), self.run)
