"""How far work is: tqdm's bar where tqdm is there, else a line of text on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

#: Called with the stage, what is done, the total (0 where it is not known) and messages; it stops the work by raising. What is done is
#: counted in rays in the stages :data:`RAY_STAGES`, in thousandths of the work in others.
ProgressCallback = Callable[[str, int, int, list[str]], object]

#: Stages that count rays.
RAY_STAGES = ("tracing", "checking")
#: tqdm's bar without the count: thousandths say no more than the percentage before the bar.
SHARE_FORMAT = "{l_bar}{bar}| [{elapsed}<{remaining}]"


class Progress:
    """Shows the stages of a job one after another."""

    def __init__(self, messages: bool = True) -> None:
        self._bar: Any = None
        self._stage = ""
        self._messages = messages
        self._shown = 0
        try:
            from tqdm.auto import tqdm
        except ImportError:
            self._tqdm: Any = None
        else:
            self._tqdm = tqdm

    def __call__(self, stage: str, done: int, total: int, messages: list[str]) -> None:
        if self._messages and messages:
            # A bar would stand in the line of the first message; it is made anew below.
            self.close()
            for message in messages:
                print(message, file=sys.stderr)
        if stage != self._stage or total == 0:
            self.close()
            self._stage = stage
        if total == 0:
            return
        if self._tqdm is not None:
            self._show_bar(done, total)
        elif sys.stderr.isatty():
            percent = 100 * done // total
            if percent != self._shown:
                self._shown = percent
                print(f"\r{stage} {percent:3d} %", end="", file=sys.stderr, flush=True)

    def _show_bar(self, done: int, total: int) -> None:
        """Moves tqdm's bar, made where there is none: a stage may learn its total late."""
        if self._bar is None:
            look = {"unit": " rays", "unit_scale": True} if self._stage in RAY_STAGES else {"bar_format": SHARE_FORMAT}
            self._bar = self._tqdm(total=total, desc=self._stage, leave=False, **look)
        elif total != self._bar.total or done < self._bar.n:
            # A run that goes on with more rays begins again from its first; a resumed one learns its total late.
            self._bar.reset(total)
        self._bar.update(done - self._bar.n)

    def close(self) -> None:
        """Takes the bar away."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None
        if self._shown:
            print("\r", end="", file=sys.stderr)
            self._shown = 0


def callback(progress: bool | ProgressCallback) -> tuple[ProgressCallback | None, Callable[[], None]]:
    """What is told of the work, and what ends it: ``True`` for a bar, ``False`` for silence, or a function."""
    if progress is True:
        shown = Progress()
        return shown, shown.close
    if progress is False:
        return None, lambda: None
    if not callable(progress):
        raise TypeError(f"progress: True, False or a function (stage, done, total, messages) is needed, not {progress!r}")
    return progress, lambda: None
