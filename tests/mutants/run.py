#!/usr/bin/env python3
"""Puts deliberate faults into a copy of the source and asks of each whether the default tests notice.

    tests/mutants/run.py [--list] [--check] [--only TEXT] [--work FOLDER] [--jobs N] [--all-areas] [--table FILE]

`faults.toml` lists them: a file, a text that stands there exactly once with the expression or statement between `«` and `»`, what takes its place, and
the areas of tests that ought to notice, each with an optional filter of names (`exact:certificates`). All of them are compiled into one program, each
behind a question for `LAMPYRIS_FAULT`, so that the trial of a fault costs no build.

A fault is *killed* when a test fails, and *survived* when all pass; `--all-areas` asks every area about the survivors before it says so. A list whose
texts no longer stand in the source, that no compiler takes, or whose areas fail without any fault, is an error and kills nothing. The exit code is the
number of survivors. The copy lies outside of the source; compiled dependencies are taken over from `target`. Nothing but Python 3.11, git and the Rust
toolchain is needed."""
import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
AREAS = ["lib", "exact", "intersect", "study", "simulate", "tessellate", "step", "formats", "cli", "hostile", "truck"]
# An area that takes longer than this hangs, s: the slowest takes two minutes on a busy machine.
LIMIT = 1800
# What the faults ask: with no number, none is in.
CHOICE = """
/// Whether this deliberate fault is in.
#[doc(hidden)]
#[allow(missing_docs)]
pub fn has_fault(number: u32) -> bool {
    static CHOSEN: std::sync::LazyLock<Option<u32>> =
        std::sync::LazyLock::new(|| std::env::var("LAMPYRIS_FAULT").ok()?.parse().ok());
    *CHOSEN == Some(number)
}
"""


class Fault(NamedTuple):
    """An entry of the list; of one that no test can see, `equivalent` is the reason."""
    name: str
    file: str
    text: str
    replacement: str
    areas: list
    equivalent: str


def read_faults():
    """The list, with the areas that a group stands for in its place."""
    listed = tomllib.loads(Path(__file__).with_name("faults.toml").read_text(encoding="utf8"))
    groups = {name: areas.split() for name, areas in listed["groups"].items()}
    areas = lambda words: [area for word in words.split() for area in groups.get(word, [word])]
    return [Fault(**{"equivalent": "", **fault, "areas": areas(fault["areas"])}) for fault in listed["fault"]]


FAULTS = read_faults()


def parts(text):
    """What stands before, within and after the marks of a text."""
    before, rest = text.split("«")
    inside, after = rest.split("»")
    return before, inside, after


def stale():
    """Names and faults of entries whose text does not stand exactly once in its file."""
    bad = {}
    for fault in FAULTS:
        path = ROOT / fault.file
        count = path.read_text(encoding="utf8").count("".join(parts(fault.text))) if path.is_file() else 0
        if count != 1:
            bad[fault.name] = f"{fault.file} holds its text {count} times"
    return bad


def with_faults(file, source):
    """The source of a file with every fault of it behind its question."""
    edits = []
    for number, fault in enumerate(FAULTS):
        if fault.file == file:
            before, inside, after = parts(fault.text)
            start = source.index(before + inside + after) + len(before)
            edits.append((start, start + len(inside), number, fault.replacement))
    # Several faults of one place are asked one after another.
    for start, end in sorted({edit[:2] for edit in edits}, reverse=True):
        inside = source[start:end]
        for other_start, other_end, number, replacement in edits:
            if (other_start, other_end) == (start, end):
                inside = f"if crate::has_fault({number}) {{ {replacement} }} else {{ {inside} }}"
        is_statement = source[start:end].rstrip().endswith((";", "}"))
        source = source[:start] + (inside if is_statement else f"({inside})") + source[end:]
    return source


def write_copy(copy):
    """Brings the copy up to the source; what is unchanged keeps its time, so that it is not built again."""
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    for file in filter(None, listed.split("\n")):
        source, target = ROOT / file, copy / file
        if not source.is_file():
            continue
        content = source.read_bytes()
        if any(fault.file == file for fault in FAULTS):
            content = with_faults(file, content.decode("utf8")).encode("utf8")
        if file == "src/lib.rs":
            content += CHOICE.encode("utf8")
        if not (target.is_file() and target.read_bytes() == content):
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
    for part in [".fingerprint", "build", "deps"]:
        source, target = ROOT / "target/debug" / part, copy / "target/debug" / part
        if source.is_dir() and not target.exists():
            # Of dependencies alone: this crate's own files belong to another folder.
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("*lampyris*"), copy_function=shutil.copy2)


def build(copy, jobs, areas):
    """The test programs of the areas."""
    chosen = [word for area in areas for word in (["--lib"] if area == "lib" else ["--test", area])]
    command = ["cargo", "test", "--offline", "--no-run", "--message-format", "json-render-diagnostics", "-j", str(jobs), *chosen]
    env = {**os.environ, "CARGO_TARGET_DIR": str(copy / "target"), "RUSTFLAGS": os.environ.get("RUSTFLAGS", "")}
    done = subprocess.run(command, cwd=copy, capture_output=True, text=True, env=env)
    if done.returncode != 0:
        # Only then: every fault makes a warning or two.
        sys.exit(f"{done.stderr}\nthe list is in error: its faults do not compile")
    programs = {}
    for line in done.stdout.splitlines():
        message = json.loads(line)
        if message.get("executable") and message["profile"]["test"]:
            target = message["target"]
            programs["lib" if "lib" in target["kind"] else target["name"]] = message["executable"]
    return programs


def failures(output):
    """Names of the tests that failed, else the last line that says something."""
    names = [line.removeprefix("test ").split(" ... ")[0] for line in output.splitlines() if line.startswith("test ") and line.endswith("FAILED")]
    last = next((line for line in reversed(output.splitlines()) if line.strip()), "no output")
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "") if names else last.strip()


def ask(programs, copy, number, areas):
    """What the tests of the areas say, one after another, until one fails: whether they notice, and how."""
    env = {**os.environ, "PROPTEST_RNG_SEED": "20261121", "CARGO_MANIFEST_DIR": str(copy)}
    env.pop("LAMPYRIS_FAULT", None)
    if number is not None:
        env["LAMPYRIS_FAULT"] = str(number)
    for area in areas:
        area, _, names = area.partition(":")
        try:
            command = [programs[area], *filter(None, names.split("+"))]
            done = subprocess.run(command, cwd=copy, capture_output=True, text=True, errors="replace", timeout=LIMIT, env=env)
        except subprocess.TimeoutExpired:
            return True, f"{area}: no end within {LIMIT} s"
        if done.returncode != 0:
            return True, f"{area}: {failures(done.stdout)}"
    return False, ""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--list", action="store_true", help="names alone")
    parser.add_argument("--check", action="store_true", help="does every text still stand where it should?")
    parser.add_argument("--only", default="", help="faults whose name or file contains this; several, with commas between")
    parser.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / "lampyris-faults", help="where the copy is kept")
    parser.add_argument("--jobs", type=int, default=4, help="of the build")
    parser.add_argument("--all-areas", action="store_true", help="ask every area about survivors")
    parser.add_argument("--no-base", action="store_true", help="skip the run without any fault")
    parser.add_argument("--table", type=Path, help="append a row of a Markdown table for each")
    options = parser.parse_args()
    chosen = [(n, f) for n, f in enumerate(FAULTS) if any(only in f.name or only in f.file for only in options.only.split(","))]
    if options.list:
        print("\n".join(f"{f.name:45} {f.file}" for _, f in chosen))
        return 0
    if bad := stale():
        sys.exit("\n".join(f"{name}: {why}" for name, why in bad.items()))
    print(f"{len(chosen)} faults stand where they should", flush=True)
    if options.check:
        return 0
    write_copy(options.work)
    wanted = dict.fromkeys(area for _, f in chosen for area in f.areas)
    areas = AREAS if options.all_areas else list(dict.fromkeys(area.partition(":")[0] for area in wanted))
    programs = build(options.work, options.jobs, areas)
    if not options.no_base:
        failed, why = ask(programs, options.work, None, areas)
        if failed:
            sys.exit(f"fails without any fault: {why}")
    survivors = []
    for number, fault in chosen:
        start = time.time()
        killed, why = ask(programs, options.work, number, fault.areas)
        if not killed and options.all_areas and not fault.equivalent:
            killed, why = ask(programs, options.work, number, AREAS)
        verdict = "killed" if killed else "equivalent" if fault.equivalent else "survived"
        why = why or fault.equivalent
        print(f"{verdict:10} {time.time() - start:5.0f} s  {fault.name}: {why}", flush=True)
        if options.table:
            with options.table.open("a", encoding="utf8") as table:
                table.write(f"| {fault.name} | {fault.file.removeprefix('src/')} | {verdict} | {why} |\n")
        if verdict == "survived":
            survivors.append(fault.name)
    print(f"{len(survivors)} survivors: {', '.join(survivors) or 'none'}")
    return len(survivors)


if __name__ == "__main__":
    sys.exit(main())
