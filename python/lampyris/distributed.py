"""One run on many machines by Dask, with the bits of a single one.

``distributed`` is all that is needed; dask-jobqueue's clusters (Slurm, PBS, LSF) give a client as any other.
"""

from __future__ import annotations

import copy
import hashlib
import json
import os
import pathlib
import signal
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import reduce
from typing import Any

from .part import Interrupted, Part
from .progress import ProgressCallback, callback
from .results import Run
from .scene import MOST_PARTS, Scene, named_files
from .settings import Settings, trace_settings, whole_number

#: Parts for each thread of the cluster: enough that a slow one or a killed one costs little.
PARTS_PER_THREAD = 4
#: Most times that a part is traced anew: what fails as often fails everywhere.
MOST_RETRIES = 1000
#: Seconds in which what is done is gathered after Ctrl-C whatever else is pressed; a further Ctrl-C then gives it up.
GATHERING_SECONDS = 10.0

#: Scenes of this process by the hash of their bundle, with the folder of their files.
_scenes: dict[str, tuple[Scene, tempfile.TemporaryDirectory[str]]] = {}
#: Tasks of one worker share its scene: the first one prepares it.
_preparing = threading.Lock()


class Bundle:
    """A scene with all files that it names, and the settings of a run: what a worker needs that shares no disk."""

    def __init__(self, scene: Scene, settings: Settings) -> None:
        tables = copy.deepcopy(scene._tables)
        self.files: dict[str, bytes] = {}
        names: dict[str, str] = {}
        for entry in named_files(tables):
            path = pathlib.Path(scene._folder, entry["file"])
            # Whatever is one file here is one file there, under its own name.
            name = names.setdefault(entry["file"], f"{len(names)}/{path.name}")
            if name not in self.files:
                self.files[name] = path.read_bytes()
            entry["file"] = name
        self.tables: dict[str, Any] = tables
        self.settings = settings
        hashes = {name: hashlib.sha256(data).hexdigest() for name, data in self.files.items()}
        words = json.dumps([tables, hashes, settings], sort_keys=True, default=str)
        self.key = hashlib.sha256(words.encode()).hexdigest()[:32]

    def scene(self) -> Scene:
        """The scene in this process, made once."""
        if self.key not in _scenes:
            # One at a time: a scene holds its model and facets.
            _scenes.clear()
            folder = tempfile.TemporaryDirectory(prefix="lampyris-scene-")
            for name, data in self.files.items():
                file = pathlib.Path(folder.name, name)
                file.parent.mkdir()
                file.write_bytes(data)
            scene = Scene()
            scene._folder = folder.name
            scene._tables = self.tables
            _scenes[self.key] = (scene, folder)
        return _scenes[self.key][0]


def _prepared_scene(bundle: Bundle) -> Scene:
    with _preparing:
        scene = bundle.scene()
        # Whoever asked for the run was warned of its models: a worker would say it for every part.
        scene._prepare(trace_settings(bundle.settings), False)
    return scene


def _received(bundle: Bundle) -> Bundle:
    return bundle


def _trace(bundle: Bundle, index: int, count: int, elsewhere: list[int]) -> bytes:
    return _prepared_scene(bundle)._trace_part((index, count), elsewhere, False, bundle.settings).to_bytes()


def _merge(bundle: Bundle, first: bytes, second: bytes) -> bytes:
    scene = _prepared_scene(bundle)
    a, b = (scene.read_part(data, **bundle.settings) for data in (first, second))
    return a.merged(b).to_bytes()


class _Tasks:
    """The tasks of a run: its parts, and sums of two whenever two are done, so that a worker holds little at a time."""

    def __init__(self, client: Any, bundle: Bundle, retries: int) -> None:
        self._client = client
        self._key = f"lampyris-{bundle.key}-{os.urandom(4).hex()}"
        self._retries = retries
        # A task, not scattered data: where the workers that hold it die, it is made anew.
        self._bundle = self._submit("scene", _received, bundle)
        #: What is in the making or done and in no finished sum, with the two of which it is the sum.
        self._open: dict[Any, tuple[Any, ...]] = {}

    def _submit(self, name: str, function: Any, *given: Any) -> Any:
        return self._client.submit(function, *given, key=f"{self._key}-{name}", retries=self._retries, pure=False)

    def submit_parts(self, parts: list[tuple[int, list[int]]], count: int) -> None:
        """Asks for these parts of ``count``, but for the replicates of each that are done elsewhere."""
        for index, elsewhere in parts:
            self._open[self._submit(f"trace-{index}", _trace, self._bundle, index, count, elsewhere)] = ()

    def sum(self, tell: ProgressCallback | None, rays: int) -> bytes:
        """The sum of all parts; ``tell`` is told of these rays as they are done."""
        from distributed import as_completed

        parts, traced, sums, single = len(self._open), 0, 0, None
        done = as_completed(list(self._open))
        for future in done:
            if future.status in ("error", "cancelled"):
                future.result()
            traced += not self._open[future]
            # A sum is there: what it is of may go.
            self._open[future] = ()
            if tell is not None:
                tell("tracing", rays * traced // parts, rays, [])
            if single is None:
                single = future
                continue
            both = (single, future)
            merged = self._submit(f"merge-{sums}", _merge, self._bundle, *both)
            self._open[merged] = both
            for part in both:
                del self._open[part]
            single, sums = None, sums + 1
            done.add(merged)
        return bytes(self._client.gather(single))

    def finished(self) -> list[bytes]:
        """Whatever parts and sums are done; nothing more is traced."""
        kept: list[Any] = []

        def keep(future: Any) -> None:
            if future.status == "finished":
                kept.append(future)
            else:
                for part in self._open.get(future, ()):
                    keep(part)

        for future in self._open:
            keep(future)
        self._client.cancel([future for future in self._open if future.status != "finished"])
        try:
            return list(self._client.gather(kept, errors="skip"))
        except OSError:
            # The scheduler is gone, and with it all that workers held.
            return []


@contextmanager
def _unhurried() -> Iterator[None]:
    """Does not hear Ctrl-C for some seconds: pressed again it must not cost what it is to keep."""
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    end = time.monotonic() + GATHERING_SECONDS
    signal.signal(signal.SIGINT, lambda number, frame: before(number, frame) if time.monotonic() > end else None)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def trace(
    scene: Scene,
    client: Any,
    shards: int | None = None,
    *,
    retries: int = 3,
    threads: int = 1,
    resume: bool | Part = False,
    progress: bool | ProgressCallback = True,
    **settings: Any,
) -> Run:
    """Traces a scene on the workers of a ``distributed.Client``; ``settings`` are those of :meth:`Scene.trace` but ``until``.

    The run is divided into ``shards`` (four for each thread of the cluster), each a pure function of the scene, so that one whose
    worker dies is traced elsewhere, ``retries`` times at most; sums are added up on the workers. Every shard traces on
    ``threads``. The digest is that of a single machine. Ctrl-C, or whatever else ends the call, leaves the sum of all shards that are done
    in ``scene.interrupted``; the same call with ``resume=True`` goes on from it, here or by :meth:`Scene.trace`, and :class:`Interrupted`
    holds it.
    """
    from distributed import Client

    from .worker_signals import workers_deaf_to_interrupts

    if not isinstance(scene, Scene):
        raise TypeError(f"scene: a lampyris.Scene is needed, not {type(scene).__name__}")
    if not isinstance(client, Client):
        raise TypeError(f"client: a distributed.Client is needed, not {type(client).__name__}; distributed.Client(cluster) makes one of a cluster")
    if client.status != "running":
        raise ValueError(f"client: its status is {client.status!r}; connect a new distributed.Client")
    shards = None if shards is None else whole_number("shards", shards, 1, MOST_PARTS)
    retries = whole_number("retries", retries, 0, MOST_RETRIES)
    threads = whole_number("threads", threads, 1, MOST_PARTS)
    if "until" in settings:
        raise ValueError("until is for one machine: give the number of rays")
    before = scene._part_to_resume(resume, settings.get("rays"))
    if before is not None:
        settings["rays"] = before._core.run_rays
    # The pilot runs once, here; what it chose is asked of every worker.
    summary = scene.prepare(progress=progress, **settings)
    if before is not None:
        # Refused here if it is of another run; and of this one from now on, whatever its number of rays was found by.
        before = scene.read_part(before.to_bytes(), **settings)
    if summary["chosen"] and not _asks_for_facets(settings):
        chosen = {k: summary[k] for k in ("intersector", "normals")}
        asked: Settings = {**settings, **chosen, "tolerance": tuple(summary["tolerance_mm"])}
    else:
        asked = dict(settings)
    count = shards or PARTS_PER_THREAD * max(1, sum(client.nthreads().values()))
    wanted = [(index, []) for index in range(count)] if before is None else before._core.undone(count)
    rays = summary["rays"] - (0 if before is None else before.rays)
    tasks = _Tasks(client, Bundle(scene, {**asked, "threads": threads}), retries)
    tell, close = callback(progress)
    with workers_deaf_to_interrupts(client):
        try:
            tasks.submit_parts(wanted, count)
            parts = [tasks.sum(tell, rays)] if wanted else []
        except BaseException as stopped:
            with _unhurried():
                _keep(scene, tasks.finished(), before, settings)
            if isinstance(stopped, KeyboardInterrupt) and scene.interrupted is not None:
                raise Interrupted(scene.interrupted) from None
            raise
        finally:
            close()
    with _unhurried():
        _keep(scene, parts, before, settings)
    return scene.trace(resume=True, progress=progress, **settings)


def _asks_for_facets(settings: Settings) -> bool:
    """Whether the settings say how fine facets are; a dict of no names does not."""
    has_bound = any(settings.get(name) is not None for name in ("tolerance", "accuracy_deg"))
    return has_bound or any(settings.get(name) for name in ("parts", "faces", "roles"))


def _keep(scene: Scene, parts: list[bytes], before: Part | None, settings: Settings) -> None:
    """Gives the scene the sum of these parts and of what was done before; what it has stays where that is nothing."""
    every = [scene.read_part(data, **settings) for data in parts] + ([] if before is None else [before])
    if every:
        scene.interrupted = reduce(Part.merged, every)
