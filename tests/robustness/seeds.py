"""Undamaged files of the formats that `run.py` damages, written field by field as their publishers describe them."""
import io
import math
import struct
import subprocess
import zipfile
from pathlib import Path

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
RAYS = 40
RECEIVER = '[[receiver]]\nname = "screen"\nat = [0, 0, 20]\nsize = [100, 100]\ncells = [10, 10]\n'
SHARD_SCENE = f'[[source]]\nkind = "lambertian"\nat = [0, 0, 0]\nsize = [1, 1]\n{RECEIVER}'


def rays():
    """Origin (mm), unit direction, power and wavelength (nm) of each ray."""
    rows = []
    for k in range(RAYS):
        d = [math.sin(k), 0.3, 1.0]
        length = math.sqrt(sum(x * x for x in d))
        rows.append([k / 10, 0.5, -1.0, *(x / length for x in d), 0.25, 450.0 + k])
    return rows


def csv():
    lines = ["x,y,z,dx,dy,dz,power,wavelength_nm"] + [",".join(str(x) for x in row) for row in rays()]
    return "\n".join(lines).encode() + b"\n"


def data1():
    """The seed's format: the number of rays, then origin, direction and power of each."""
    lines = [str(RAYS)] + [" ".join(str(x) for x in row[:7]) for row in rays()]
    return "\n".join(lines).encode() + b"\n"


def npy(shape, numbers):
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode()
    head += b" " * (-(len(head) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head + struct.pack(f"<{len(numbers)}d", *numbers)


def npz():
    rows, out = rays(), io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, columns in [("origin", slice(0, 3)), ("direction", slice(3, 6))]:
            archive.writestr(f"{name}.npy", npy((RAYS, 3), [x for row in rows for x in row[columns]]))
        archive.writestr("power.npy", npy((RAYS,), [row[6] for row in rows]))
    return out.getvalue()


def tm25():
    """IES TM-25: radiant flux and a wavelength per ray."""
    head = b"TM25" + struct.pack("<iiffQ", 2013, 0, 0.0, 0.25 * RAYS, RAYS) + b"2026-01-01T00:00:00+00:00".ljust(28, b"\0")
    head += struct.pack("<ii3f", 0, 2, *[0.0] * 3) + struct.pack("<iii", 0, 0, 0) + bytes(168)
    head += struct.pack("<8i", 1, 1, 1, 1, 0, 0, 0, 0) + bytes(9 * 4000)
    return head + b"".join(struct.pack("<8f", *row) for row in rays())


def zemax():
    head = struct.pack("<iI100s7f", 1010, RAYS, b"a source", 10.0, 10.0, 0.0, 0, 0, 0, 0)
    head += struct.pack("<I52xii8x", 4, 2, 0)
    return head + b"".join(struct.pack("<8f", *row[:7], row[7] / 1000) for row in rays())


def lighttools():
    head = b"LTRF" + struct.pack("<6I4f", 2, 0, 0, 0, 2, 1, 0, 0, 0, 10.0)
    return head + b"".join(struct.pack("<8f", *row) for row in rays()) + b"LTRFEND"


def ies():
    vertical, horizontal = [0, 30, 60, 90], [0, 90, 180, 270, 360]
    text = "IESNA:LM-63-2002\r\n[TEST] 1\r\n[MANUFAC] nobody\r\nTILT=NONE\r\n1 1000 1 4 5 1 2 0.1 0.1 0\r\n1 1 10\r\n"
    text += " ".join(map(str, vertical)) + "\r\n" + " ".join(map(str, horizontal)) + "\r\n"
    return (text + "\r\n".join(" ".join(str(100 + 10 * h - v) for v in vertical) for h in range(5)) + "\r\n").encode()


def ldt():
    """EULUMDAT of a lamp without symmetry: 4 planes of 5 angles."""
    lines = ["nobody", "1", "0", "4", "90", "5", "22.5", "1", "a lamp", "2", "lamp.ldt", "2026", "100", "50", "10", "100", "50"]
    lines += ["0"] * 4 + ["100", "100", "1", "0", "1", "1", "LED", "1000", "4000", "80", "10"] + ["0.5"] * 10
    lines += ["0", "90", "180", "270"] + ["0", "22.5", "45", "67.5", "90"] + [str(100 + k) for k in range(20)]
    return ("\r\n".join(lines) + "\r\n").encode()


FORMATS = {
    "rays": {"a.csv": csv, "a.npz": npz, "a.tm25ray": tm25, "a.dat": zemax, "a.ray": lighttools, "a.data1": data1},
    "photometry": {"a.ies": ies, "a.ldt": ldt},
}


# Kind of source by the ending of a file.
KINDS = {".ies": "ies", ".ldt": "eulumdat", ".data1": "data_1"}


def source_scene(kind, file):
    """A scene whose only source is a file."""
    unit = "W" if kind == "rays" else "lm"
    kind = KINDS.get(Path(file).suffix, "rays")
    return f'[run]\nunit = "{unit}"\n[[source]]\nkind = "{kind}"\nfile = "{Path(file).name}"\n{RECEIVER}'


def tally_scene(folder):
    scene = folder / "scene.toml"
    scene.write_text(SHARD_SCENE)
    return scene


def write(kind, folder, program):
    """Writes the seeds of a kind and proves that the program takes each undamaged."""
    trace = [program, "trace", "scene.toml", "-q", "--no-report", "--rays", "2000", "-o"]
    if kind == "tally":
        tally_scene(folder)
        subprocess.run([*trace, "part.tally", "--shard", "1/1"], cwd=folder, check=True)
        merge = [program, "merge", "part.tally", "--scene", "scene.toml", "-o", "out", "-q", "--no-report"]
        subprocess.run(merge, cwd=folder, check=True)
        return [folder / "part.tally"]
    files = []
    for name, content in FORMATS[kind].items():
        files.append(folder / name)
        files[-1].write_bytes(content())
        (folder / "scene.toml").write_text(source_scene(kind, name))
        subprocess.run([*trace, f"out-{name}"], cwd=folder, check=True)
    return files
