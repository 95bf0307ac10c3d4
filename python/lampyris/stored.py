"""Results that were pickled: their figures and arrays, without the scene that they are of."""

from __future__ import annotations

import json
from typing import Any, Union

from . import _lampyris
from ._types import FloatArray

_Pair = tuple[FloatArray, FloatArray]


class StoredCells:
    """The arrays of some receivers, by their place in the scene."""

    def __init__(self, results: Cells, documents: dict[int, dict[str, Any]]) -> None:
        self._layers = {k: results.layers(k) for k in documents}
        self._edges = {k: results.edges(k) for k in documents}
        channels = {k: range(len(document["channels"])) for k, document in documents.items()}
        self._channels = {k: [results.channel(k, c) for c in numbers] for k, numbers in channels.items()}

    def layers(self, receiver: int) -> tuple[FloatArray, FloatArray, FloatArray | None]:
        """The cells of a receiver and their errors."""
        return self._layers[receiver]

    def edges(self, receiver: int) -> _Pair:
        """The edges of the cells of a receiver."""
        return self._edges[receiver]

    def channel(self, receiver: int, channel: int) -> _Pair:
        """The cells of a further channel of a receiver and their errors."""
        return self._channels[receiver][channel]


class StoredResults(StoredCells):
    """All that a run tells."""

    def __init__(self, results: _lampyris.Results) -> None:
        self._document = results.document_json()
        super().__init__(results, dict(enumerate(json.loads(self._document)["receivers"])))
        self.digest = results.digest
        self._model_notes = results.model_notes()
        self._paths = results.paths()
        self._verdicts: str | _lampyris.SceneError
        try:
            self._verdicts = results.verdicts_json()
        except _lampyris.SceneError as e:
            self._verdicts = e

    def document_json(self) -> str:
        """The document of ``results.json``."""
        return self._document

    def model_notes(self) -> list[str]:
        """Sentences on what the models of the scene lack."""
        return self._model_notes

    def verdicts_json(self) -> str:
        """The verdicts of the scene's regulations."""
        if isinstance(self._verdicts, _lampyris.SceneError):
            raise self._verdicts
        return self._verdicts

    def paths(self) -> Any:
        """Recorded paths vertex by vertex."""
        return self._paths


#: Where the arrays of receivers come from.
Cells = Union[_lampyris.Results, StoredCells]
