"""One run on many machines by Dask, with the bits of a single one.

``distributed`` is all that is needed; dask-jobqueue's clusters (Slurm, PBS, LSF) give a client as any other.
"""

from __future__ import annotations

import copy
import hashlib
import json
import os
import pathlib
import tempfile
import threading
from typing import Any

from .part import Part
from .results import Run
from .scene import MOST_PARTS, Scene, named_files
from .settings import Settings, whole_number

#: Parts for each thread of the cluster: enough that a slow one or a killed one costs little.
PARTS_PER_THREAD = 4
#: Most times that a part is traced anew: what fails as often fails everywhere.
MOST_RETRIES = 1000

#: Scenes of this process by the hash of their bundle, with the folder of their files.
_scenes: dict[str, tuple[Scene, tempfile.TemporaryDirectory[str]]] = {}
#: Tasks of one worker share its scene: the first one prepares it.
_preparing = threading.Lock()


class Bundle:
    """A scene with all files that it names, and the settings of a run: what a worker needs that shares no disk."""

    def __init__(self, scene: Scene, settings: Settings) -> None:
        tables = copy.deepcopy(scene._tables)
        self.files: dict[str, bytes] = {}
        for entry in named_files(tables):
            path = pathlib.Path(scene._folder, entry["file"])
            data = path.read_bytes()
            name = f"{hashlib.sha256(data).hexdigest()[:16]}-{path.name}"
            self.files[name] = data
            entry["file"] = name
        self.tables: dict[str, Any] = tables
        self.settings = settings
        words = json.dumps([tables, sorted(self.files), settings], sort_keys=True, default=str)
        self.key = hashlib.sha256(words.encode()).hexdigest()[:32]

    def scene(self) -> Scene:
        """The scene in this process, made once."""
        if self.key not in _scenes:
            # One at a time: a scene holds its model and facets.
            _scenes.clear()
            folder = tempfile.TemporaryDirectory(prefix="lampyris-scene-")
            for name, data in self.files.items():
                pathlib.Path(folder.name, name).write_bytes(data)
            scene = Scene()
            scene._folder = folder.name
            scene._tables = self.tables
            _scenes[self.key] = (scene, folder)
        return _scenes[self.key][0]


def _prepared_scene(bundle: Bundle) -> Scene:
    with _preparing:
        scene = bundle.scene()
        scene.prepare(progress=False, **bundle.settings)
    return scene


def _received(bundle: Bundle) -> Bundle:
    return bundle


def _trace(bundle: Bundle, index: int, count: int) -> bytes:
    return _prepared_scene(bundle).trace_part(index, count, **bundle.settings).to_bytes()


def _merge(bundle: Bundle, first: bytes, second: bytes) -> bytes:
    scene = _prepared_scene(bundle)
    a, b = (scene.read_part(data, **bundle.settings) for data in (first, second))
    return a.merged(b).to_bytes()


def trace(
    scene: Scene,
    client: Any,
    shards: int | None = None,
    *,
    retries: int = 3,
    threads: int = 1,
    progress: bool = True,
    **settings: Any,
) -> Run:
    """Traces a scene on the workers of a ``distributed.Client``; ``settings`` are those of :meth:`Scene.trace` but ``until``.

    The run is divided into ``shards`` (four for each thread of the cluster), each a pure function of the scene, so that one whose
    worker dies is traced elsewhere, ``retries`` times at most; the sums are added up as a tree on the workers. Every shard traces on
    ``threads``. The digest is that of a single machine.
    """
    from distributed import Client

    if not isinstance(scene, Scene):
        raise TypeError(f"scene: a lampyris.Scene is needed, not {type(scene).__name__}")
    if not isinstance(client, Client):
        raise TypeError(f"client: a distributed.Client is needed, not {type(client).__name__}; distributed.Client(cluster) makes one of a cluster")
    if client.status != "running":
        raise ValueError(f"client: its status is {client.status!r}; connect a new distributed.Client")
    shards = None if shards is None else whole_number("shards", shards, 1, MOST_PARTS)
    retries = whole_number("retries", retries, 0, MOST_RETRIES)
    threads = whole_number("threads", threads, 1, MOST_PARTS)
    if "until" in settings or "resume" in settings:
        raise ValueError("until and resume are for one machine: give the number of rays")
    # The pilot runs once, here; what it chose is asked of every worker.
    local = Bundle(scene, settings).scene()
    summary = local.prepare(progress=progress, **settings)
    if not any(settings.get(k) for k in ("tolerance", "accuracy_deg", "parts", "faces", "roles")) and summary["chosen"]:
        chosen = {k: summary[k] for k in ("intersector", "normals")}
        asked: Settings = {**settings, **chosen, "tolerance": tuple(summary["tolerance_mm"])}
    else:
        asked = dict(settings)
    bundle = Bundle(scene, {**asked, "threads": threads})
    count = shards or PARTS_PER_THREAD * max(1, sum(client.nthreads().values()))
    key = f"lampyris-{bundle.key}-{os.urandom(4).hex()}"
    # A task, not scattered data: where the workers that hold it die, it is made anew.
    sent = client.submit(_received, bundle, key=f"{key}-scene", retries=retries, pure=False)
    parts = [
        client.submit(_trace, sent, k, count, key=f"{key}-trace-{k}", retries=retries, pure=False)
        for k in range(count)
    ]
    level = 0
    while len(parts) > 1:
        pairs = range(0, len(parts) - 1, 2)
        sums = [
            client.submit(_merge, sent, parts[k], parts[k + 1], key=f"{key}-merge-{level}-{k}", retries=retries, pure=False)
            for k in pairs
        ]
        parts = sums + parts[2 * len(sums) :]
        level += 1
    data = client.gather(parts[0])
    whole: Part = local.read_part(data, **settings)
    return local.trace(resume=whole, progress=progress, **settings)
