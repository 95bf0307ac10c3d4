"""Scenes: read from TOML or built here, traced to figures with both errors."""

from __future__ import annotations

import copy
import hashlib
import json
import os
import pathlib
import tempfile
import warnings
from collections.abc import Iterable
from typing import Any

from . import _lampyris
from ._types import FaceTolerances, Path, Table, Tolerance, Tolerances, plain, table_from_json, table_to_json
from .errors import existing_file, file_path, writable_file, write_file
from .materials import Material, Selector
from .mesh import Mesh
from .model import Model
from .part import Interrupted, Part, part_bytes, part_core
from .progress import ProgressCallback, callback
from .receivers import ReceiverTable
from .results import Ends, LostLightWarning, Run
from .settings import Settings, trace_settings, whole_number, word
from .sources import Source

#: Most parts that a run is divided into; there are never as many replicates.
MOST_PARTS = 2**32 - 1


class Scene:
    """A scene: models, materials, sources, receivers, as the tables of a scene file.

    ``models`` are STEP files or models that were read; ``unit`` is ``"W"`` or ``"lm"``; further keywords are those of ``[run]``.

    What is built call by call is checked when it is used, by :meth:`prepare`, :meth:`trace` and what else needs the facets: files that are
    not there, keys and parts that nobody knows. A scene that is read (:meth:`from_toml`, :meth:`parse`) has its keys checked at once.
    """

    def __init__(
        self,
        models: Path | Model | Iterable[Path | Model] = (),
        *,
        title: str = "",
        unit: str = "W",
        **run: Any,
    ) -> None:
        self._tables: Table = {"run": plain({"unit": word("unit", unit), **run})}
        if word("title", title):
            self._tables["title"] = title
        # What was read, until the tables are given out.
        self._text: str | None = None
        self._name = "scene"
        self._folder = os.getcwd()
        self._models: list[Model] = []
        self._ray_folder: tempfile.TemporaryDirectory[str] | None = None
        self._prepared: tuple[str, _lampyris.Prepared] | None = None
        #: What an interrupted trace left.
        self.interrupted: Part | None = None
        if isinstance(models, (str, bytes, os.PathLike, Model)) or not isinstance(models, Iterable):
            models = [models]
        for model in models:
            self.add_model(model)

    @classmethod
    def from_toml(cls, path: Path) -> Scene:
        """Reads a scene file; what it names is relative to its folder."""
        file = pathlib.Path(existing_file(path, what="the scene file"))
        if file.suffix.lower() in (".stp", ".step", ".p21"):
            raise _lampyris.SceneError(f"{file}: a STEP file, where a scene (.toml) is needed; lampyris.Scene({str(file)!r}) makes one")
        try:
            text = file.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as e:
            raise _lampyris.InputError(f"{file}: cannot read the scene file: {e}; check the path") from e
        return cls.parse(text, folder=file.absolute().parent, name=str(path))

    @classmethod
    def parse(cls, text: str, folder: Path = ".", name: str = "scene") -> Scene:
        """From the text of a scene file."""
        scene = cls()
        scene._folder = os.path.abspath(file_path(folder, "folder"))
        scene._tables = table_from_json(_lampyris.scene_to_json(word("text", text), name, scene._folder))
        scene._text = text
        scene._name = name
        return scene

    @property
    def tables(self) -> Table:
        """The tables of the scene file; changes count."""
        self._text = None
        return self._tables

    def add_model(self, model: Path | Model, **keys: Any) -> Scene:
        """Puts a STEP file, or a model that was read, into the scene; ``keys`` are those of ``[[model]]``, such as ``placement``, or
        ``without=[lampyris.select(part="helper*")]`` for what is left out."""
        if isinstance(model, Model):
            self._models.append(model)
            keys = {"unit_mm": model.unit_mm, **keys}
            model = model.path
        elif not isinstance(model, (str, bytes, os.PathLike)):
            raise TypeError(f"a model is needed, as a path or lampyris.read_step(path), not {type(model).__name__}")
        if "without" in keys:
            keys = {**keys, "without": [s.table if isinstance(s, Selector) else s for s in keys["without"]]}
        self.tables.setdefault("model", []).append(plain({"file": os.path.abspath(file_path(model, "model")), **keys}))
        return self

    def medium(self, name: str, **keys: Any) -> Scene:
        """Describes a medium: ``index=1.49``, ``sellmeier=…``, ``absorption_per_mm=…``."""
        self.tables.setdefault("medium", []).append(plain({"name": name, **keys}))
        return self

    def __setitem__(self, where: str | Selector, material: Material) -> None:
        """``scene["housing"] = mirror(0.95)``: what the faces of a part, or of a selector, are made of; later rules win."""
        if not isinstance(material, Material):
            raise TypeError(f"a material is needed, as lampyris.mirror(0.9), not {type(material).__name__}")
        if not isinstance(where, (str, Selector)):
            raise TypeError(f"a part's name or lampyris.select(…) is needed, not {where!r}; several parts are select(part=[…])")
        selector = where.table if isinstance(where, Selector) else {"part": where}
        if material.medium is not None:
            media = self.tables.setdefault("medium", [])
            if material.medium not in media:
                media.append(dict(material.medium))
        self.tables.setdefault("material", []).append({**selector, **material.table})

    def add(self, *things: Source | ReceiverTable) -> Scene:
        """Adds sources and receivers."""
        for thing in things:
            if isinstance(thing, Source):
                self._add_source(thing)
            elif isinstance(thing, ReceiverTable):
                self.tables.setdefault("receiver", []).append(dict(thing.table))
            else:
                raise TypeError(f"a source or a receiver is needed, as lampyris.led(…), not {type(thing).__name__}")
        return self

    def _add_source(self, source: Source) -> None:
        table = dict(source.table)
        if "file" in table:
            table["file"] = os.path.abspath(table["file"])
        if source.rays is not None:
            if self._ray_folder is None:
                self._ray_folder = tempfile.TemporaryDirectory(prefix="lampyris-rays-")
            # By content, so that the same rays make the same scene.
            name = hashlib.sha256(source.rays.tobytes()).hexdigest()[:16] + ".npz"
            table["file"] = os.path.join(self._ray_folder.name, name)
            _lampyris.write_ray_file(table["file"], source.rays)
        self.tables.setdefault("source", []).append(table)

    def to_toml(self) -> str:
        """The scene file: the very text that was read, or the tables."""
        # Tables that were given out may change at any time: their text is made anew each time.
        return _lampyris.toml_from_json(table_to_json(self._tables)) if self._text is None else self._text

    def save(self, path: Path) -> None:
        """Writes the scene file; what it names stands there by its absolute path, rays that came as an array in files beside it."""
        scene_file = pathlib.Path(writable_file(path)).absolute()
        tables = copy.deepcopy(self._tables)
        for entry in named_files(tables):
            file = pathlib.Path(self._folder, entry["file"]).absolute()
            if self._ray_folder is not None and file.parent == pathlib.Path(self._ray_folder.name):
                # The folder for temporary files goes with this process.
                kept = scene_file.with_name(f"{scene_file.stem}-{file.name}")
                write_file(kept, file.read_bytes())
                entry["file"] = kept.name
            else:
                entry["file"] = str(file)
        write_file(scene_file, _lampyris.toml_from_json(table_to_json(tables)))

    def prepare(self, *, progress: bool | ProgressCallback = True, **settings: Any) -> Settings:
        """Reads, binds and facets the scene, and chooses how to trace it; says how. ``settings`` are those of :meth:`trace`."""
        prepared = self._prepare_and_warn(trace_settings(settings), progress)
        return dict(json.loads(prepared.summary_json()))

    def facets(self, **settings: Any) -> Mesh:
        """The facets that a trace with these settings is about; on the spline those that it is drawn and checked with."""
        return Mesh(self._prepare_and_warn(trace_settings(settings), False).mesh)

    def _prepare_and_warn(self, settings: Settings, progress: bool | ProgressCallback) -> _lampyris.Prepared:
        """Prepares, and warns the caller of a method of what the models lack: before a trace, which a filter that raises would throw away."""
        prepared = self._prepare(settings, progress)
        for sentence in prepared.model_notes():
            warnings.warn(sentence, stacklevel=3)
        return prepared

    def _prepare(self, settings: Settings, progress: bool | ProgressCallback) -> _lampyris.Prepared:
        text = self.to_toml()
        read = {model.path for model in self._models}
        for entry in named_files(self._tables):
            file = os.path.join(self._folder, str(entry["file"]))
            if file not in read:
                existing_file(file)
        # A file that was written anew makes another scene.
        files = [_state_of(os.path.join(self._folder, str(entry["file"]))) for entry in named_files(self._tables)]
        words = json.dumps([text, self._folder, settings, files], default=str)
        key = hashlib.sha256(words.encode()).hexdigest()
        if self._prepared is None or self._prepared[0] != key:
            tell, close = callback(progress)
            try:
                cores = [model._core for model in self._models]
                prepared = _lampyris.Prepared(text, self._name, self._folder, cores, settings, tell)
            finally:
                close()
            self._prepared = (key, prepared)
        return self._prepared[1]

    def trace(
        self,
        rays: int | None = None,
        *,
        until: str | None = None,
        seed: int | None = None,
        threads: int | None = None,
        tolerance: Tolerance | None = None,
        angle_deg: float | None = None,
        accuracy_deg: float | None = None,
        parts: Tolerances | None = None,
        faces: FaceTolerances | None = None,
        roles: Tolerances | None = None,
        normals: str | None = None,
        intersector: str | None = None,
        resume: bool | Part = False,
        progress: bool | ProgressCallback = True,
    ) -> Run:
        """Traces the scene: so many ``rays``, or as many as an error asks for, as ``until="1%@far"``.

        What is not said the scene says; without ``tolerance``, ``accuracy_deg``, ``normals`` and ``intersector`` a pilot of the run's own
        rays chooses them. The bits are those of ``lampyris trace`` with the same settings, for any number of threads.

        - ``until``: the statistical error (1σ) of a receiver's power in percent, ``"1%@far"``, or with ``:cells`` that of its cells,
          weighted by their light; the % may be left out. ``rays`` are then the most to trace.
        - ``seed``: of all random numbers. ``threads``: all cores unless given, and never more than 16 for each core.
        - ``tolerance``: distance from facets to the surface, mm: one number, or two, ``(0.05, 0.2)``, tight where curved and loose where
          flat. ``parts``, ``faces`` and ``roles`` overrule it: dicts of such tolerances by name of the part, by name or ``#id`` of the face
          (``{3979: 0.01}``), by role (``mirror``, ``interface``, ``coated``, ``absorber``).
        - ``angle_deg``: largest angle between facet and surface normal, degrees.
        - ``accuracy_deg``: direction error in degrees, the 99th percentile at curved faces, in place of ``tolerance``; tolerance and
          normals are searched for.
        - ``normals``: ``flat``, ``nearest``, ``bilinear``, ``cubic``, or ``exact``, which moves hits to the spline. ``intersector``:
          ``octree``, ``bvh2``, ``cwbvh`` or ``exact``, the spline itself.
        - ``progress``: ``True`` for a bar, ``False`` for silence, or a function ``f(stage, done, total, messages)``, which stops the run by
          raising.

        Ctrl-C raises :class:`Interrupted`; the same call with ``resume=True`` then goes on, ``resume=part`` from any part of the run. The
        GIL is free meanwhile.
        """
        settings = trace_settings(dict(
            rays=rays, seed=seed, threads=threads, tolerance=tolerance, angle_deg=angle_deg, accuracy_deg=accuracy_deg,
            parts=parts, faces=faces, roles=roles, normals=normals, intersector=intersector,
        ))
        until = None if until is None else word("until", until)
        part = self._part_to_resume(resume, rays if until is None else None)
        core = None if part is None else part._core
        prepared = self._prepare_and_warn(settings, progress)
        tell, close = callback(progress)
        words = None
        try:
            if until is not None:
                found, rest, stopped, words = prepared.trace_until(until, core, tell)
            else:
                found, rest, stopped = prepared.trace(core, tell)
        finally:
            close()
        if rest is not None:
            self.interrupted = Part(rest)
            _raise_stopped(stopped, self.interrupted)
        if found is None:
            raise _lampyris.Defect("a trace ended without results; please report it")
        self.interrupted = None
        run = Run(found, None if words is None else json.loads(words))
        lost = found.lost_light()
        if lost is not None:
            warnings.warn(LostLightWarning(lost, run), stacklevel=2)
        return run

    def _part_to_resume(self, resume: bool | Part, rays: int | None) -> Part | None:
        """What is to be gone on from: the part that was left for ``True``, none for ``False``; it must be of a run of so many rays."""
        if resume is False:
            return None
        if resume is True:
            if self.interrupted is None:
                raise ValueError("resume=True: no trace of this scene was interrupted; leave it out, or give a part")
            resume = self.interrupted
        of = part_core(resume, "resume").run_rays
        if rays is not None and of != rays:
            raise ValueError(f"resume: this part is of a run of {of} rays, not {rays}; leave `rays` out to go on with it, or trace anew")
        return resume

    def ends(self, *, progress: bool | ProgressCallback = True, **settings: Any) -> Ends:
        """Where every ray of the scene's lists ended: each is traced once, by itself, with its own power, as ``lampyris trace --ends`` does.

        ``settings`` are those of :meth:`trace`.
        """
        prepared = self._prepare_and_warn(trace_settings(settings), progress)
        tell, close = callback(progress)
        try:
            return Ends(*prepared.ends(tell))
        finally:
            close()

    def trace_part(
        self, index: int, count: int, *, progress: bool | ProgressCallback = False, **settings: Any
    ) -> Part:
        """Traces part ``index`` (from 0) of ``count`` of the run; ``settings`` are those of :meth:`trace`.

        Ctrl-C raises :class:`Interrupted` with what was done of the part.
        """
        place = (whole_number("index", index, 0, MOST_PARTS), whole_number("count", count, 1, MOST_PARTS))
        self._prepare_and_warn(trace_settings(settings), progress)
        return self._trace_part(place, [], progress, settings)

    def _trace_part(
        self, place: tuple[int, int], elsewhere: list[int], progress: bool | ProgressCallback, settings: Settings
    ) -> Part:
        """Traces a part, but for the replicates that are done elsewhere."""
        prepared = self._prepare(trace_settings(settings), progress)
        tell, close = callback(progress)
        try:
            core, stopped = prepared.trace_part(*place, elsewhere, tell)
        finally:
            close()
        part = Part(core)
        _raise_stopped(stopped, part)
        return part

    def read_part(self, data: bytes, **settings: Any) -> Part:
        """A part from its bytes; it must be of this scene with the same settings."""
        return Part(self._prepare(trace_settings(settings), False).read_part(part_bytes(data)))

    def __copy__(self) -> Scene:
        """A scene to be changed by itself, with the same models; nothing is prepared for it yet, and nothing interrupted."""
        made = Scene()
        for name in ("_text", "_name", "_folder", "_models", "_ray_folder"):
            setattr(made, name, getattr(self, name))
        made._models = list(self._models)
        made._tables = copy.deepcopy(self._tables)
        return made

    def __deepcopy__(self, _memo: dict[int, Any]) -> Scene:
        return self.__copy__()

    def __getstate__(self) -> dict[str, Any]:
        # Files go by their paths, but those of rays that came as an array, which end with this process.
        folder = None if self._ray_folder is None else pathlib.Path(self._ray_folder.name)
        rays = {} if folder is None else {str(file): file.read_bytes() for file in folder.iterdir()}
        kept = {name: getattr(self, name) for name in ("_text", "_name", "_folder", "_models", "interrupted")}
        return {**kept, "_tables": copy.deepcopy(self._tables), "rays": rays}

    def __setstate__(self, state: dict[str, Any]) -> None:
        rays = state.pop("rays")
        self.__dict__.update(state, _prepared=None, _ray_folder=None)
        if rays:
            self._ray_folder = tempfile.TemporaryDirectory(prefix="lampyris-rays-")
            self._text = None
        for entry in named_files(self._tables):
            if self._ray_folder is not None and entry["file"] in rays:
                file = pathlib.Path(self._ray_folder.name, pathlib.Path(entry["file"]).name)
                file.write_bytes(rays[entry["file"]])
                entry["file"] = str(file)

    def __repr__(self) -> str:
        tables = self._tables
        counts = ", ".join(f"{len(tables.get(k, []))} {k}s" for k in ("model", "material", "source", "receiver"))
        return f"<lampyris.Scene {tables.get('title', '')!r}: {counts}>"


def named_files(tables: Table) -> list[Table]:
    """The tables of models, sources and media that name a file."""
    lists = [tables.get(kind) for kind in ("model", "source", "medium")]
    # What is no list of tables is refused where the scene is read.
    entries = [entry for entries in lists if isinstance(entries, (list, tuple)) for entry in entries]
    return [entry for entry in entries if isinstance(entry, dict) and "file" in entry]


def _raise_stopped(stopped: BaseException | None, part: Part) -> None:
    """Raises what stopped a trace; what was done goes with Ctrl-C."""
    if isinstance(stopped, KeyboardInterrupt):
        raise Interrupted(part) from None
    if stopped is not None:
        raise stopped


def _state_of(file: str) -> list[int] | None:
    """Size and time of a file; ``None`` where there is none."""
    try:
        state = os.stat(file)
    except OSError:
        return None
    return [state.st_size, state.st_mtime_ns]


def media() -> list[str]:
    """Names of the media that need no table."""
    return _lampyris.media()


def scene_schema() -> dict[str, Any]:
    """The JSON Schema of scene files."""
    return dict(json.loads(_lampyris.scene_schema()))
