#!/usr/bin/env python3
"""Twelve kinds of end at which finished rays could be lost, and one of the rescue: what each leaves must give the digest of a run that was let be.

    tests/robustness/ends.py target/release/lampyris [KIND...]

Linux; a read-only and a full file system need root (small tmpfs mounts), and are named as skipped without it.
"""
import argparse
import os
import re
import shutil
import signal
import sys
import tempfile
from pathlib import Path

from runs import FIXTURES, Run, Skipped, digest, expect, files, mounted, run, wait_for

RAYS = 1_000_000
LONG = ["--rays", str(RAYS)]


def lens(folder, change=lambda text: text, name="scene.toml"):
    """A scene of one lens and its model in a folder."""
    folder.mkdir(exist_ok=True)
    shutil.copy(FIXTURES / "step" / "lens_planoconvex_nurbs.stp", folder / "model.stp")
    text = (FIXTURES / "scenes" / "s1_lens.toml").read_text().replace("../step/lens_planoconvex_nurbs.stp", "model.stp")
    (folder / name).write_text(change(text))
    return folder


class Ends:
    """Each method named `end_…` brings one end about in a folder of its own and returns the digest of what was got back."""

    def __init__(self, program, folder):
        self.program, self.root = program, folder
        self.folder = lens(folder / "undisturbed")
        self.trace("whole")
        self.expected = digest(self.folder / "whole")

    def trace(self, out, *options, scene="scene.toml", code=0):
        return run([self.program, "trace", scene, "-q", "-o", out, *LONG, *options], self.folder, code)

    def begin(self, out="out", every="0"):
        """A run that has saved some of itself, or that traces, where it is to save nothing."""
        command = [self.program, "trace", "scene.toml", "-o", out, "--threads", "1", "--checkpoint", every, *LONG]
        started = Run(command, self.folder)
        wait_for(started, self.folder / out / ("checkpoint.tally" if every == "0" else ".lampyris.lock"))
        return started

    def trace_in_parts(self, out, scene="scene.toml"):
        """The digest of a run in two parts, which are merged."""
        for part in "12":
            self.trace("parts", "--shard", f"{part}/2", scene=scene)
        run([self.program, "merge", "parts", "-o", out, "-q"], self.folder)
        return digest(self.folder / out)

    def resumed(self):
        self.trace("out", "--resume")
        return digest(self.folder / "out")

    def finished(self, started):
        """The digest of what a run that is to end well leaves."""
        code, err = started.wait()
        expect(code == 0, f"exit {code}: {err}")
        return digest(self.folder / "out")

    def rescued(self, err):
        """The digest of the folder that a message names."""
        message = " ".join(err.split())
        found = re.search(r"nothing is lost: the results are in (\S+)", message)
        expect(found, f"no rescue: {message}")
        place = Path(found.group(1))
        value = digest(place)
        shutil.rmtree(place)
        return value

    def end_read_only(self):
        with mounted(self.folder / "disk", "8m") as disk:
            started = self.begin("disk/out")
            disk.make_read_only()
            code, err = started.wait()
            expect(code == 1, f"exit {code}")
            again, refusal = self.trace("disk/again", code=1)
            expect("nothing was traced" in refusal or "cannot be" in refusal, refusal)
            return self.rescued(err)

    def end_full_disk(self):
        with mounted(self.folder / "disk", "9m") as disk:
            started = self.begin("disk/out", every="3600")
            disk.fill()
            code, err = started.wait()
            expect(code == 1, f"exit {code}")
            return self.rescued(err)

    def end_long_name(self):
        lens(self.folder, lambda text: text.replace('"focus"', f'"{"A" * 260}"'))
        self.trace("out")
        expect(len([f for f in files(self.folder / "out") if f.startswith("A" * 50)]) >= 4, "files of the receiver")
        # The name is part of no ray, but of the scene: the powers are compared by a run of the same scene in parts.
        expect(digest(self.folder / "out") == self.trace_in_parts("merged"), "merged otherwise")
        return self.expected

    def end_path_without_text(self):
        odd = b"sc\xff\xfene.toml"
        os.rename(self.folder / "scene.toml", os.fsencode(self.folder) + b"/" + odd)
        return self.trace_in_parts("out", os.fsdecode(odd))

    def resumed_after(self, number, code):
        started = self.begin()
        os.kill(started.pid, number)
        ended, err = started.wait()
        expect(ended == code, f"exit {ended}: {err}")
        _, refusal = self.trace("out", code=2)
        expect("--resume" in refusal, refusal)
        return self.resumed()

    def end_kill(self):
        return self.resumed_after(signal.SIGKILL, -signal.SIGKILL)

    def end_term(self):
        return self.resumed_after(signal.SIGTERM, 1)

    def end_int(self):
        return self.resumed_after(signal.SIGINT, 1)

    def end_hup(self):
        return self.resumed_after(signal.SIGHUP, 1)

    def end_closed_stdout(self):
        started = Run([self.program, "trace", "scene.toml", "-o", "out", "--json", *LONG], self.folder)
        started.close_stdout()
        return self.finished(started)

    def end_memory(self):
        started = self.begin()
        started.limit_memory()
        code, err = started.wait()
        expect(code != 0, "it did not run out of memory")
        return self.resumed()

    def end_two_owners(self):
        started = self.begin()
        _, refusal = self.trace("out", "--resume", code=1)
        expect(f"process {started.pid}" in refusal, refusal)
        return self.finished(started)

    def end_removed_folder(self):
        started = self.begin()
        shutil.rmtree(self.folder / "out")
        code, err = started.wait()
        return digest(self.folder / "out") if code == 0 else self.rescued(err)

    def end_rescued_accuracy(self):
        """Nothing but the sums can be written: they are merged, with the facets that an accuracy had come to."""
        (self.folder / "out" / "facets.glb" / "full").mkdir(parents=True)
        nowhere = {"HOME": "/proc/none", "TMPDIR": "/proc/none"}
        scene, out = str(self.folder / "scene.toml"), str(self.folder / "out")
        command = [self.program, "trace", scene, "-q", "-o", out, "--rays", "20000", "--accuracy", "0.1deg"]
        code, err = run(command, Path("/proc"), 1, **nowhere)
        expect("lampyris merge" in " ".join(err.split()), err)
        run([self.program, "merge", "out/checkpoint.tally", "-o", "merged", "-q"], self.folder)
        digest(self.folder / "merged")
        return self.expected


def main():
    kinds = [name.removeprefix("end_") for name in vars(Ends) if name.startswith("end_")]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("kinds", nargs="*", default=kinds, help=f"of {', '.join(kinds)}")
    options = parser.parse_args()
    lost = 0
    with tempfile.TemporaryDirectory() as name:
        ends = Ends(str(Path(options.program).resolve()), Path(name))
        for kind in options.kinds:
            ends.folder = lens(Path(name) / kind)
            try:
                answer = "nothing lost" if getattr(ends, f"end_{kind}")() == ends.expected else "OTHER BITS"
            except Skipped as reason:
                answer = f"skipped: {reason}"
            except AssertionError as reason:
                answer = f"LOST: {reason}"
            lost += answer.startswith(("LOST", "OTHER"))
            print(f"{kind.replace('_', ' ')}: {answer}", flush=True)
    sys.exit(lost > 0)


if __name__ == "__main__":
    main()
