"""Ctrl-C on workers of this machine: a terminal or notebook sends it to them too, and what they hold would end with them."""

from __future__ import annotations

import os
import signal
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from distributed.diagnostics.plugin import WorkerPlugin

#: Under what the plugin is known to the scheduler.
NAME = "lampyris-ctrl-c"


def _group() -> tuple[str, int]:
    """What Ctrl-C goes to at once: a group of processes of a machine."""
    return socket.gethostname(), os.getpgrp() if hasattr(os, "getpgrp") else 0


class DeafToInterrupts(WorkerPlugin):
    """Workers of the group of processes that made this do not hear Ctrl-C, those to come neither."""

    idempotent = True
    name = NAME

    def __init__(self) -> None:
        self.group, self.process = _group(), os.getpid()
        self.before: Any = None

    def setup(self, worker: Any) -> None:
        """Stops listening, in a process of its own."""
        is_own = os.getpid() != self.process and threading.current_thread() is threading.main_thread()
        if is_own and self.group == _group():
            self.before = signal.signal(signal.SIGINT, signal.SIG_IGN)

    def teardown(self, worker: Any) -> None:
        """Listens as before."""
        if self.before is not None:
            signal.signal(signal.SIGINT, self.before)


@contextmanager
def workers_deaf_to_interrupts(client: Any) -> Iterator[None]:
    """Lets Ctrl-C reach this process alone."""
    client.register_plugin(DeafToInterrupts())
    try:
        yield
    finally:
        if client.status == "running":
            client.unregister_worker_plugin(NAME)
