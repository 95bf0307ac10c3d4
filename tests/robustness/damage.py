#!/usr/bin/env python3
"""Damaged files through the command: no panic, no hang, no memory beyond measure, no number that is none.

    tests/robustness/damage.py target/release/lampyris step --count 2000 [--seeds FOLDER ...] [--keep FOLDER]
    tests/robustness/damage.py target/release/lampyris scenes --count 500
    tests/robustness/damage.py target/release/lampyris rays photometry tally          # 200 of each format

The damage of copy k is drawn from a generator seeded with --seed, the seed's name and k, so that it comes again. Each process has a limit
of CPU and memory. What is counted: a panic (101) or an end by a signal; more CPU seconds than --seconds; a peak of more than 1 GB and more than 50
times the file; exit 0 or 4 with a power that is no number; for a tally, any answer but a refusal. Exits with 1 when there is one.
"""
import argparse
import collections
import concurrent.futures
import json
import math
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import seeds

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
MEMORY = 10**9  # bytes that a small file may take
TIMES_FILE = 50  # and times its size that a large one may
KILLED_AT = 6  # times --seconds of CPU at which a process is ended
ADDRESS_SPACE = 8 * 10**9  # bytes at which an allocation fails
CODES = {0, 1, 2, 3, 4}
NUMBERS = [b"1e30", b"0", b"nan", b"-1", b"1e-30", b"1e308", b"-1e30", b"inf", b"99999999999999999999", b"0.", b"1e6", b"2", b"0.5", b"45", b"1e-3"]
# Files between two lines on how far a kind is.
TOLD_EVERY = 50
ODD_STRINGS = ["", "*", "\\u001b[31m", "A" * 300, "../x", "=1+1", "nul\\u0000", "\\u202e", "mirror", "far_field", "glass", "N-BK7"]


# ---- damage -------------------------------------------------------------------------------------------------------------------------


def place(data, rng):
    """A place in the data, seldom one of the zeros that binary formats are padded with."""
    places = [rng.randrange(len(data)) for _ in range(5)]
    return next((p for p in places if data[p]), places[0])


def cut(data, rng):
    return data[: rng.randrange(len(data) + 1)]


def flipped(data, rng):
    data = bytearray(data)
    for _ in range(rng.randint(1, 8)):
        data[place(data, rng)] ^= 1 << rng.randrange(8)
    return bytes(data)


def random_bytes(data, rng):
    at = place(data, rng)
    return data[:at] + rng.randbytes(8) + data[at + 8 :]


def without_piece(data, rng):
    at = place(data, rng)
    return data[:at] + data[at + rng.randint(1, 64) :]


def with_piece_twice(data, rng):
    at, to = place(data, rng), place(data, rng)
    return data[:to] + data[at : at + rng.randint(1, 64)] + data[to:]


def lines_changed(data, rng):
    lines = data.split(b"\n")
    for _ in range(rng.randint(1, 5)):
        k = rng.randrange(len(lines))
        lines[k : k + 1] = rng.choice([[], [lines[k]] * 2, [lines[rng.randrange(len(lines))]]])
        lines = lines or [b""]
    return b"\n".join(lines)


def replaced(pattern, data, rng, new, most=4):
    """Some of what a pattern finds, replaced by what `new` gives for it."""
    found = list(re.finditer(pattern, data))
    for match in sorted(rng.sample(found, min(len(found), rng.randint(1, most))), key=lambda m: -m.start()):
        data = data[: match.start()] + new(match.group()) + data[match.end() :]
    return data


NUMBER = rb"(?<![#\w.])-?\d[\d_]*\.?\d*(?:[eE][-+]?\d+)?"


def numbers_changed(data, rng):
    return replaced(NUMBER, data, rng, lambda _: rng.choice(NUMBERS))


def ids_crossed(data, rng):
    ids = re.findall(rb"#\d+", data) or [b"#1"]
    return replaced(rb"#\d+", data, rng, lambda _: rng.choice(ids), 6)


def keywords_crossed(data, rng):
    pattern = rb"(?<==)\s*[A-Z][A-Z0-9_]+"
    words = re.findall(pattern, data) or [b"X"]
    return replaced(pattern, data, rng, lambda _: rng.choice(words), 2)


def strings_changed(data, rng):
    return replaced(rb'"[^"\n]*"', data, rng, lambda _: b'"' + rng.choice(ODD_STRINGS).encode() + b'"', 2)


OWN_RAYS = rb"(?m)^(rays\s*=\s*)[\d_]+"


def undamaged(kind, seed):
    """A seed's bytes; of a scene with few rays, also where its sources have theirs whatever the command asks for."""
    data = seed.read_bytes()
    return re.sub(OWN_RAYS, rb"\g<1>2_000", data) if kind == "scenes" else data


ANY = [cut, flipped, random_bytes, without_piece, with_piece_twice, numbers_changed]
DAMAGE = {
    "step": ANY + [lines_changed, numbers_changed, ids_crossed, ids_crossed, keywords_crossed],
    # What no longer is TOML is refused at once: most of the damage is to values.
    "scenes": [numbers_changed] * 10 + [lines_changed] * 3 + [strings_changed] * 2 + [flipped, cut, with_piece_twice],
    "rays": ANY + [lines_changed],
    "photometry": ANY + [lines_changed, numbers_changed],
    "tally": [cut, flipped, random_bytes, without_piece, with_piece_twice],
}


def damaged(kind, data, rng):
    whole = data
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        data = rng.choice(DAMAGE[kind])(data, rng) or b"\n"
    return data if data != whole else data + b"\0"


# ---- processes ----------------------------------------------------------------------------------------------------------------------


class Outcome:
    """How a process ended, and what it took."""

    def __init__(self, command, folder, seconds):
        def limits():
            resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
            resource.setrlimit(resource.RLIMIT_CPU, (KILLED_AT * seconds, KILLED_AT * seconds + 1))
            os.nice(5)

        out, err = folder / "stdout", folder / "stderr"
        start = time.monotonic()
        with open(out, "wb") as to, open(err, "wb") as to_err:
            child = subprocess.Popen(command, stdout=to, stderr=to_err, cwd=folder, preexec_fn=limits, stdin=subprocess.DEVNULL)
            # A process that waits for ever takes no CPU.
            while True:
                pid, status, usage = os.wait4(child.pid, os.WNOHANG)
                if pid:
                    break
                if time.monotonic() - start > 20 * KILLED_AT * seconds:
                    child.kill()
                time.sleep(0.005)
        child.returncode = self.code = os.waitstatus_to_exitcode(status)
        self.wall = time.monotonic() - start
        self.cpu = usage.ru_utime + usage.ru_stime
        self.bytes = usage.ru_maxrss * 1024
        self.out, self.err = out.read_bytes(), err.read_bytes()

    def faults(self, kind, size, seconds):
        faults = []
        if self.code not in CODES or b"panicked at" in self.err:
            faults.append(f"code {self.code}")
        if self.cpu > seconds:
            faults.append(f"{self.cpu:.1f} s")
        if self.bytes > max(MEMORY, TIMES_FILE * size):
            faults.append(f"{self.bytes / 1e6:.0f} MB")
        if kind == "tally":
            if self.code == 0:
                faults.append("taken")
        elif self.code in (0, 4):
            faults.extend(no_numbers(self.out))
        # With exit 4 the document on stdout says what was refused.
        if self.code in (1, 2, 3) and not self.err.strip():
            faults.append("no message")
        return faults


def no_numbers(out):
    """Powers of the document on stdout that are no numbers."""
    try:
        document = json.loads(out, parse_constant=lambda text: math.nan)
    except ValueError as error:
        return [f"no JSON: {error}"]
    powers = dict(document.get("power", {}))
    for receiver in document.get("receivers", []):
        powers[receiver["name"]] = receiver["power"]
    return [f"power {name!r} is {value}" for name, value in powers.items() if not isinstance(value, (int, float)) or not math.isfinite(value)]


# ---- the kinds ----------------------------------------------------------------------------------------------------------------------


def commands(kind, program, file, folder):
    """The commands that a damaged file is given to."""
    trace = [program, "trace", "scene.toml", "--json", "-q", "--no-report", "-o", "out"]
    if kind == "step":
        return [[program, "info", file, "--json"], [program, "facet", file, "--json", "-q"]]
    if kind == "scenes":
        shutil.copy(file, folder / "scene.toml")
        return [[*trace, "--rays", "2000"]]
    if kind == "tally":
        return [[program, "merge", file, "--scene", seeds.tally_scene(folder), "-o", "out", "--json", "--no-report"]]
    (folder / "scene.toml").write_text(seeds.source_scene(kind, file))
    return [[*trace, "--rays", "2000"]]


def trial(program, kind, seed, k, options):
    """One damaged copy: the list of its faults, and what it took at most."""
    data = damaged(kind, undamaged(kind, seed), random.Random(f"{options.seed} {seed.name} {k}"))
    with tempfile.TemporaryDirectory() as name:
        # Scenes name their models from where they lie.
        folder = Path(name) / "scenes"
        folder.mkdir()
        os.symlink(FIXTURES / "step", Path(name) / "step")
        if kind == "scenes":
            shutil.copy(FIXTURES / "headlamp" / "low_beam.stp", folder)
        file = folder / seed.name
        file.write_bytes(data)
        rows = []
        for command in commands(kind, program, file, folder):
            outcome = Outcome(command, folder, options.seconds)
            faults = outcome.faults(kind, len(data), options.seconds)
            if faults:
                message = outcome.err.decode(errors="replace").strip()[-300:]
                rows.append(f"{seed.name} {k} {command[1]}: {', '.join(faults)}; {outcome.cpu:.1f} s CPU, {outcome.wall:.1f} s wall; {message!r}")
                if options.keep:
                    shutil.copy(file, Path(options.keep) / f"{seed.stem}_{k}{seed.suffix}")
            rows.append(outcome)
    return rows


def seed_files(kind, options, program, folder):
    """Undamaged files of a kind."""
    if kind == "step":
        files = [f for where in [FIXTURES / "step", FIXTURES / "headlamp", *options.seeds] for f in sorted(Path(where).glob("*.st*p"))]
        return [f for f in files if f.stat().st_size <= options.largest]
    if kind == "scenes":
        return sorted(FIXTURES.glob("scenes/*.toml")) + sorted(FIXTURES.glob("headlamp/*.toml"))
    return seeds.write(kind, folder, program)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("kinds", nargs="+", choices=list(DAMAGE))
    parser.add_argument("--count", type=int, help="damaged copies in all; by default 200 of each seed")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seeds", nargs="*", default=[], help="more folders of STEP files")
    parser.add_argument("--largest", type=int, default=300_000, help="largest STEP file that is damaged, bytes")
    parser.add_argument("--seconds", type=int, default=10, help="CPU seconds that one file may take")
    parser.add_argument("--keep", help="folder for the files that show a fault")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    program = str(Path(options.program).resolve())
    if options.keep:
        Path(options.keep).mkdir(parents=True, exist_ok=True)
    failed = 0
    for kind in options.kinds:
        with tempfile.TemporaryDirectory() as name:
            files = seed_files(kind, options, program, Path(name))
            count = options.count or 200 * len(files)
            pool = concurrent.futures.ThreadPoolExecutor(options.jobs)
            trials = pool.map(lambda k: trial(program, kind, files[k % len(files)], k // len(files), options), range(count))
            worst, most, codes, faults = 0.0, 0, collections.Counter(), 0
            for done, rows in enumerate(trials, 1):
                for row in rows:
                    if isinstance(row, str):
                        faults += 1
                        print(row, flush=True)
                        continue
                    worst, most = max(worst, row.cpu), max(most, row.bytes)
                    codes[row.code] += 1
                # A run of hours that is ended early has said how far it was, and what it had found.
                if done % TOLD_EVERY == 0 and done < count:
                    print(f"{kind}: {done} of {count}: {faults} faults; worst {worst:.1f} s CPU, {most / 1e6:.0f} MB", flush=True)
            failed += faults
            ends = ", ".join(f"{n} × {code}" for code, n in sorted(codes.items()))
            print(f"{kind}: {count} files of {len(files)} seeds: {faults} faults; exits {ends}; worst {worst:.1f} s CPU, {most / 1e6:.0f} MB", flush=True)
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
