"""Small tables and pictures for notebooks."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any


def number(value: Any, digits: int = 5) -> str:
    """A number as people read it."""
    if value is None:
        return "–"
    if isinstance(value, float):
        return f"{value:.{digits}g}"
    return str(value)


def table(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A table; every text is escaped."""
    head = "".join(f"<th>{escape(h)}</th>" for h in header)
    body = "".join("<tr>" + "".join(f"<td>{escape(number(x))}</td>" for x in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def picture(png: bytes, caption: str, width: int = 320) -> str:
    """A picture with its caption."""
    data = base64.b64encode(png).decode()
    style = f"width:{width}px;image-rendering:pixelated"
    return f'<figure><img style="{style}" src="data:image/png;base64,{data}"/><figcaption>{escape(caption)}</figcaption></figure>'
