"""Processes that are ended in odd ways, and file systems that are read-only or full."""
import contextlib
import json
import os
import resource
import signal
import subprocess
import tempfile
import time
from pathlib import Path

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
PATIENCE = 600  # seconds that anything may take


class Skipped(Exception):
    """What this machine or this user cannot do."""


def expect(holds, message):
    if not holds:
        raise AssertionError(message)


def heed_interrupts():
    """What a shell starts in the background ignores SIGINT, and under nohup SIGHUP, and so does all that it starts."""
    for name in (signal.SIGINT, signal.SIGHUP):
        signal.signal(name, signal.SIG_DFL)


class Run:
    """A process whose messages are kept."""

    def __init__(self, command, folder, **environment):
        self.messages = tempfile.TemporaryFile()
        variables = {**os.environ, "NO_COLOR": "1", "COLUMNS": "400", **environment}
        self.child = subprocess.Popen(
            command,
            cwd=folder,
            env=variables,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=self.messages,
            preexec_fn=heed_interrupts,
        )
        self.pid, self.usage, self.is_starved = self.child.pid, None, False

    def is_running(self):
        if self.usage is None:
            pid, status, usage = os.wait4(self.pid, os.WNOHANG)
            if pid:
                self.child.returncode, self.usage = os.waitstatus_to_exitcode(status), usage
        return self.usage is None

    def wait(self):
        """Exit code, or minus the signal, and messages."""
        end = time.monotonic() + PATIENCE
        while self.is_running():
            if time.monotonic() > end:
                self.child.kill()
                raise AssertionError(f"it did not end within {PATIENCE} s")
            time.sleep(0.01)
        self.messages.seek(0)
        return self.child.returncode, self.messages.read().decode(errors="replace")

    def close_stdout(self):
        self.child.stdout.close()

    def limit_memory(self):
        """No more address space than it has."""
        size = int(Path(f"/proc/{self.pid}/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
        self.is_starved = True
        resource.prlimit(self.pid, resource.RLIMIT_AS, (size, size))

    def peak_bytes(self):
        return self.usage.ru_maxrss * 1024


def run(command, folder, code=0, **environment):
    """Runs to the end, which is to have this exit code; gives it and the messages."""
    started = Run(command, folder, **environment)
    started.close_stdout()
    ended, err = started.wait()
    expect(ended == code, f"{' '.join(map(str, command[1:]))}: exit {ended}, not {code}: {err[-500:]}")
    return ended, err


def wait_for(started, file):
    """Waits until a process has made a file."""
    end = time.monotonic() + PATIENCE
    while not file.exists():
        if not started.is_running():
            raise AssertionError(f"it ended before it saved anything: {started.wait()}")
        expect(time.monotonic() < end, "nothing was saved")
        time.sleep(0.005)


def digest(folder):
    file = folder / "results.json"
    expect(file.exists(), f"{folder} holds no results")
    return json.loads(file.read_text())["digest"]


def files(folder):
    return sorted(entry.name for entry in folder.iterdir())


class Disk:
    """A small file system."""

    def __init__(self, folder):
        self.folder = folder

    def make_read_only(self):
        # Refused as long as a file is open for writing: between two checkpoints.
        for _ in range(2000):
            if subprocess.run(["mount", "-o", "remount,ro", self.folder], capture_output=True).returncode == 0:
                return
            time.sleep(0.003)
        raise Skipped("it could not be made read-only while it was written")

    def fill(self):
        with contextlib.suppress(OSError), open(self.folder / "filler", "ab", buffering=0) as filler:
            while True:
                filler.write(bytes(4096))

    def make_room(self):
        (self.folder / "filler").unlink(missing_ok=True)


@contextlib.contextmanager
def mounted(folder, size):
    folder.mkdir(exist_ok=True)
    if subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder], capture_output=True).returncode != 0:
        raise Skipped("mounting a tmpfs needs root")
    try:
        yield Disk(folder)
    finally:
        subprocess.run(["umount", "-l", folder], check=True)
