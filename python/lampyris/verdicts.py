"""Verdicts of lamp regulations."""

from __future__ import annotations

from html import escape
from typing import Any

from . import _html, _lampyris


class Assessment(dict[str, Any]):
    """A far field judged row by row: the object of ``lampyris assess --json``."""

    @property
    def verdict(self) -> str:
        """``pass``, ``fail`` or ``unsure``."""
        return str(self["verdict"])

    @property
    def traffic(self) -> str:
        """The side of the road that it was judged for: ``right`` or ``left``."""
        return str(self["traffic"])

    def to_frame(self) -> Any:
        """A ``pandas.DataFrame``, a row of the table each."""
        import pandas

        return pandas.DataFrame(self["rows"])

    def _repr_html_(self) -> str:
        keys = ("id", "min", "max", "value", "statistical", "geometric", "verdict")
        text = _html.table(keys, ([row[k] for k in keys] for row in self["rows"]))
        return f"<p>{escape(self['regulation'])}: <b>{self.verdict}</b></p>{text}"


def regulations() -> dict[str, str]:
    """The lamp regulations that there are tables of: id and name."""
    return {id_: name for id_, name, _, _ in _lampyris.regulations()}
