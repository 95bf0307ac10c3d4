#!/usr/bin/env python3
"""A run that is killed, stopped, frozen, starved of memory and of disk at random moments and resumed, again and again, against one that was let be.

    tests/robustness/soak.py target/release/lampyris [--minutes 10] [--seed 1]

Each cycle traces the same scene to its end through whatever happens; digest and receiver files must have the bits of the undisturbed run, and
no process may need more memory than that one and a tenth. Linux; the full disk needs root (a tmpfs) and is left out without it.
"""
import argparse
import collections
import contextlib
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path

from ends import lens
from runs import Run, Skipped, digest, expect, files, mounted, run

MEMORY_MARGIN = 1.1  # over the undisturbed run: threads meet at other moments
LONGEST_QUIET = 1.5  # seconds from the start of a process, or from one event, to the next


class Soak:
    """One scene, traced to its end again and again."""

    def __init__(self, program, folder, disk, rays, rng):
        self.folder, self.disk, self.rng = folder, disk, rng
        self.command = [program, "trace", "scene.toml", "-q", "--no-report", "--rays", str(rays), "--checkpoint", "0.2", "-o"]
        self.happened, self.peaks = collections.Counter(), []
        lens(folder)
        undisturbed = Run([*self.command, "whole"], folder)
        expect(undisturbed.wait()[0] == 0, "the undisturbed run failed")
        self.whole, self.limit = folder / "whole", MEMORY_MARGIN * undisturbed.peak_bytes()

    def events(self):
        names = ["kill", "term", "int", "hup", "freeze", "memory"]
        return [*names, "disk"] if self.disk else names

    def disturb(self, process):
        """Does something to a process, which may end of it."""
        event = self.rng.choice(self.events())
        self.happened[event] += 1
        with contextlib.suppress(ProcessLookupError, FileNotFoundError):
            if event == "freeze":
                os.kill(process.pid, signal.SIGSTOP)
                time.sleep(self.rng.uniform(0.05, 0.5))
                os.kill(process.pid, signal.SIGCONT)
            elif event == "memory":
                process.limit_memory()
            elif event == "disk":
                self.disk.fill()
                time.sleep(self.rng.uniform(0.1, 1.0))
                self.disk.make_room()
            else:
                os.kill(process.pid, getattr(signal, f"SIG{event.upper()}"))

    def go_on(self, out):
        """Starts the run, or goes on with it, and disturbs it; whether it came to its end."""
        process = Run([*self.command, out, "--resume"], self.folder)
        while process.is_running():
            quiet = time.monotonic() + self.rng.uniform(0.0, LONGEST_QUIET)
            while process.is_running() and time.monotonic() < quiet:
                time.sleep(0.01)
            if process.is_running():
                self.disturb(process)
        code, err = process.wait()
        self.peaks.append(process.peak_bytes())
        # Without memory Rust's own start of a thread panics; whatever it is, nothing may be lost by it.
        expect(process.is_starved or "panicked" not in err, f"exit {code}: {err}")
        expect(code not in (2, 3), f"exit {code}: {err}")
        rescued = [f for f in files(self.folder) if f.startswith("lampyris-rescued-")]
        for name in rescued:
            # What a full disk drove elsewhere: sums go back to where the message says, results are the answer.
            place = self.folder / name
            if name.endswith(".tally"):
                shutil.move(place, Path(self.folder, out, "checkpoint.tally"))
                continue
            # A process that ended while it wrote them leaves no results there, and its checkpoint where it was.
            whole = (place / "results.json").exists()
            if whole:
                self.compare(place)
            shutil.rmtree(place)
            if whole:
                return True
        return code == 0

    def compare(self, place):
        expect(digest(place) == digest(self.whole), f"other bits after {dict(self.happened)}")
        for name in files(self.whole):
            if name.endswith((".csv", ".data3", ".npz", ".vti")):
                expect((place / name).read_bytes() == (self.whole / name).read_bytes(), f"{name} differs")

    def cycle(self):
        out = self.disk.folder / "out" if self.disk else self.folder / "out"
        starts = 1
        while not self.go_on(str(out)):
            starts += 1
        if out.exists() and (out / "results.json").exists():
            self.compare(out)
        shutil.rmtree(out, ignore_errors=True)
        return starts


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--minutes", type=float, default=10)
    parser.add_argument("--rays", type=int, default=6_000_000, help="of a cycle: some seconds")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    end = time.monotonic() + 60 * options.minutes
    with tempfile.TemporaryDirectory() as name, contextlib.ExitStack() as stack:
        try:
            disk = stack.enter_context(mounted(Path(name) / "disk", "16m"))
        except Skipped as reason:
            disk, _ = None, print(f"no full disk: {reason}")
        soak = Soak(str(Path(options.program).resolve()), Path(name) / "soak", disk, options.rays, random.Random(options.seed))
        cycles = starts = 0
        while time.monotonic() < end:
            starts += soak.cycle()
            cycles += 1
        half = len(soak.peaks) // 2
        first, second = max(soak.peaks[:half], default=0), max(soak.peaks[half:])
        print(f"{cycles} cycles, {starts} processes, {dict(soak.happened)}: same bits")
        print(f"peak memory {first / 1e6:.0f} MB in the first half, {second / 1e6:.0f} MB in the second; undisturbed {soak.limit / MEMORY_MARGIN / 1e6:.0f} MB")
        sys.exit(second > soak.limit)


if __name__ == "__main__":
    main()
