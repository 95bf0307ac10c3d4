"""Parts of runs, and what Ctrl-C leaves."""

from __future__ import annotations

from typing import Any

from . import _lampyris
from ._types import Path
from .errors import write_file


class Part:
    """What was traced of a run: to be kept, sent, added to other parts, and gone on from with ``trace(resume=part)``."""

    def __init__(self, core: _lampyris.Part) -> None:
        if not isinstance(core, _lampyris.Part):
            raise TypeError("a Part is what a run leaves, or lampyris.Part.from_bytes(data)")
        self._core = core

    @classmethod
    def from_bytes(cls, data: bytes) -> Part:
        """A part from its bytes, of whatever run: it can be added to others, and is gone on from where it belongs; so are pickled ones."""
        return cls(_lampyris.Part.from_bytes(part_bytes(data)))

    @property
    def rays(self) -> int:
        """Rays that are done."""
        return self._core.rays

    @property
    def done(self) -> int:
        """Replicates that are done."""
        return self._core.done

    @property
    def replicates(self) -> int:
        """Replicates of the whole run."""
        return self._core.replicates

    @property
    def is_whole(self) -> bool:
        """Whether nothing is left to trace."""
        return self._core.is_whole

    def merged(self, other: Part) -> Part:
        """The sum with another part of the same run; ``ValueError`` for one of another run, or with what is in this one already."""
        return Part(self._core.merged(part_core(other, "other")))

    def to_bytes(self) -> bytes:
        """For a file or another machine; :meth:`Scene.read_part` and :meth:`from_bytes` read them."""
        return self._core.to_bytes()

    def save(self, path: Path) -> None:
        """Writes the bytes into a file."""
        write_file(path, self.to_bytes())

    def __reduce__(self) -> tuple[Any, ...]:
        return Part.from_bytes, (self.to_bytes(),)

    def __deepcopy__(self, _memo: dict[int, Any]) -> Part:
        # Nothing of it can be changed.
        return self

    def __repr__(self) -> str:
        return repr(self._core)


class Interrupted(KeyboardInterrupt):
    """Ctrl-C stopped a trace; ``part`` is what was done, and the scene keeps it as ``interrupted``."""

    def __init__(self, part: Part) -> None:
        share = f"{part.done} of {part.replicates} replicates ({part.rays} rays)"
        super().__init__(f"{share} are kept: the same trace with resume=True goes on from there")
        #: What was done.
        self.part = part

    def __reduce__(self) -> tuple[Any, ...]:
        return Interrupted, (self.part,)


def part_bytes(data: Any) -> bytes:
    """The bytes of a part; ``TypeError`` for anything else."""
    if not isinstance(data, (bytes, bytearray, memoryview)):
        raise TypeError(f"data: the bytes of a part are needed, not {type(data).__name__}; open(path, 'rb').read() gives those of a file")
    return bytes(data)


def part_core(part: object, name: str) -> _lampyris.Part:
    """The extension's half of a part; ``TypeError`` for anything else."""
    if not isinstance(part, Part):
        raise TypeError(f"{name}: a Part is needed, not {type(part).__name__}; scene.read_part(bytes, …) makes one of what was saved")
    return part._core
