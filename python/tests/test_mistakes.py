"""What a wrong setting, scene, array or file is told: what it must be, and what to do."""

from __future__ import annotations

import pathlib
from typing import Any

import numpy as np
import pytest
from conftest import LAMP, lamp

import lampyris as lp


@pytest.mark.parametrize(
    ("change", "kind", "says"),
    [
        (lambda s: s.trace(rays=0), ValueError, "at least 1"),
        (lambda s: s.trace(tolerance=-1), ValueError, "from 1e-7 on"),
        (lambda s: s.trace(tolerance=(1, 2, 3)), ValueError, "one number of mm or two"),
        (lambda s: s.trace(normals="round"), ValueError, "normals"),
        (lambda s: s.trace(intersector="quadtree"), ValueError, "octree, bvh2, cwbvh, exact"),
        (lambda s: s.trace(threads=0), ValueError, "threads = 0: it must be a whole number, at least 1$"),
        (lambda s: s.trace(threads=float("inf")), ValueError, "threads = inf: it must be a whole number"),
        (lambda s: s.trace(threads="two"), TypeError, "threads"),
        (lambda s: s.trace(seed=-1), ValueError, "seed = -1: .* at least 0"),
        (lambda s: s.trace(parts={"huosing": 0.1}), ValueError, "parts huosing: .* did you mean 'housing'"),
        (lambda s: s.trace(until="1%@fra"), ValueError, "until 1%@fra: .* did you mean 'far'"),
        (lambda s: s.trace(until="x"), ValueError, "until x: write P%@RECEIVER"),
        (lambda s: s.trace(faces={-1: 0.1}), ValueError, "faces #-1: "),
        (lambda s: s.trace(faces=0.1), TypeError, "faces: a dict of names or numbers and tolerances"),
        (lambda s: s.trace(parts={17: 0.1}), TypeError, "parts: a dict of names and tolerances"),
        (lambda s: s.trace(resume=True), ValueError, "no trace of this scene was interrupted"),
        (lambda s: s.__setitem__("housing", 0.9), TypeError, r"lampyris.mirror\(0.9\)"),
        (lambda s: s.add("light"), TypeError, "source or a receiver"),
        (lambda s: s.trace(rays="1e6"), TypeError, "rays: a whole number is needed, not '1e6'"),
        (lambda s: s.trace(rays=float("nan")), ValueError, "rays = nan: it must be a whole number"),
        (lambda s: s.trace(rays=2.5), ValueError, "whole number"),
        (lambda s: s.trace(rays=10**30), ValueError, "at most 20000000000000"),
        (lambda s: s.trace(seed=2**70), ValueError, "seed = .* at most 18446744073709551615"),
        (lambda s: s.trace(threads=-1), ValueError, "threads = -1: .* at least 1"),
        (lambda s: s.trace(parts=0.1), TypeError, "parts: a dict of names and tolerances"),
        (lambda s: s.trace(tolerance="fine"), ValueError, "one number of mm or two"),
        (lambda s: s.trace(normals=3), TypeError, "normals: a text is needed"),
        (lambda s: s.trace(until=1), TypeError, "until: a text is needed"),
        (lambda s: s.trace(progress="yes"), TypeError, "True, False or a function"),
        (lambda s: s.trace(resume="part.bin"), TypeError, r"scene.read_part\(bytes"),
        (lambda s: s.prepare(until="1%@far"), TypeError, "until is for Scene.trace alone"),
        (lambda s: s.prepare(ray=5), TypeError, "ray is no setting of a trace; there are rays"),
        (lambda s: s.trace_part(0, 0), ValueError, "count = 0"),
        (lambda s: s.trace_part(3, 3), ValueError, "part 3 of 3: the index counts from 0"),
        (lambda s: s.trace_part(0, 3).merged("x"), TypeError, "other: a Part is needed"),
        (lambda s: s.__setitem__(3, lp.mirror()), TypeError, r"lampyris.select\(…\) is needed"),
        (lambda s: s.add_model(3), TypeError, r"lampyris.read_step\(path\)"),
        (lambda s: s.add(lp.led(colour=1j)).trace(), TypeError, r"source\[1\].colour: a scene holds numbers"),
        (lambda s: s.add(lp.far_field("f", h_deg=(5,), step_deg=1)), ValueError, r"h_deg = \(5,\): two finite angles"),
        (lambda s: s.add(lp.led(at=(0, 0, float("nan")))).trace(), ValueError, "three finite numbers"),
        (lambda s: s.trace(rays=500, progress=False).assess("R1", "far"), ValueError, r"lampyris.regulations\(\) has all"),
        (lambda s: s.trace(accuracy_deg=0.1, tolerance=0.1), ValueError, "both say how fine"),
        (lambda s: s.trace(tolerance=True), ValueError, "one number of mm or two"),
        (lambda s: s.trace(tolerance=(0.1, True)), ValueError, "one number of mm or two"),
        (lambda s: s.trace(tolerance="0.1"), ValueError, "one number of mm or two"),
        (lambda s: s.trace(parts={"": 0.1}), ValueError, "parts: '' is no name"),
        (lambda s: s.trace(resume=None), TypeError, "resume: a Part is needed, not NoneType"),
        (lambda s: s.read_part("part.bin"), TypeError, "data: the bytes of a part are needed, not str"),
        (lambda s: s.read_part(bytearray(b"part")), ValueError, "the part cannot be used"),
        (lambda s: lp.Scene(seed=2**63).to_toml(), ValueError, r"run.seed = 9223372036854775808: .* trace\(seed=…\) takes"),
        (lambda s: lp.Scene(unit=3), TypeError, "unit: a text is needed"),  # type: ignore[arg-type]
        (lambda s: lp.Scene(title=3), TypeError, "title: a text is needed"),  # type: ignore[arg-type]
        (lambda s: lp.Scene(b"lamp.stp"), TypeError, r"model: .* not bytes; os.fsdecode\(b'lamp.stp'\)"),  # type: ignore[arg-type]
        (lambda s: s.add(lp.far_field("f", step_deg="1")), TypeError, "step_deg: a number is needed"),  # type: ignore[arg-type]
        (lambda s: s.add(lp.far_field("f", step_deg=1, cells=(3, 3))), ValueError, "both say how fine"),
        (lambda s: s.add(lp.plane(None, at=(0, 0, 1))), TypeError, "name: a text is needed"),  # type: ignore[arg-type]
        (lambda s: s.add(lp.plane("p", at=None)), TypeError, "plane: at = None: three numbers"),  # type: ignore[arg-type]
        (lambda s: s.add(lp.point(at=None)), TypeError, "point: at = None: three numbers"),  # type: ignore[arg-type]
        (lambda s: s.add(lp.collimated(at=(0, 0, 0), direction=None)), TypeError, "collimated: direction = None"),  # type: ignore[arg-type]
        (lambda s: s.add(lp.ies(None)), TypeError, "file: a str or os.PathLike is needed, not None"),  # type: ignore[arg-type]
        (lambda s: s.trace(tolerance=1e-300), ValueError, r"tolerance \(1e-300, 1e-300\): .* from 1e-7 on"),
        (lambda s: s.tables.update(source=[5]) or s.trace(), ValueError, "source"),
        (lambda s: s.tables.update(model=5) or s.trace(), ValueError, "model"),
        (lambda s: lp.Scene.parse(5), TypeError, "text: a text is needed, not 5"),  # type: ignore[arg-type]
        (lambda s: lp.Scene.from_toml(""), OSError, "path: '' names no file"),
        (lambda s: s.save(b"lamp.toml"), TypeError, r"path: .* not bytes; os.fsdecode\(b'lamp.toml'\)"),
    ],
)
def test_wrong_settings_are_told_what_to_do(change: Any, kind: Any, says: str) -> None:
    scene = lamp(2000)
    with pytest.raises(kind, match=says):
        change(scene)


def test_wrong_files_are_told_what_to_do(tmp_path: pathlib.Path) -> None:
    with pytest.raises(OSError, match="check the path"):
        lp.read_step(tmp_path / "absent.stp")
    (tmp_path / "no.stp").write_text("solid x")
    with pytest.raises(lp.InputError, match="not a STEP file"):
        lp.read_step(tmp_path / "no.stp")
    with pytest.raises(lp.SceneError, match="a STEP file, where a scene"):
        lp.Scene.from_toml(LAMP)
    with pytest.raises(OSError, match="cannot read the scene"):
        lp.Scene.from_toml(tmp_path / "absent.toml")
    with pytest.raises(lp.SceneError, match=r"slip:2:1.*rays"):
        lp.Scene.parse("[run]\nray = 5\n", name="slip")
    scene = lamp(2000)
    scene["cover"] = lp.mirror(0.9)
    with pytest.raises(lp.SceneError, match="cover"):
        scene.trace(progress=False)


@pytest.mark.parametrize("tolerance", [np.float32(0.25), np.array(0.25), np.array([0.25, 0.25]), [0.25, 0.25], (0.25, 0.25)])
def test_numbers_of_numpy_are_numbers(tolerance: Any, lens: pathlib.Path) -> None:
    assert len(lp.read_step(lens).tessellate(tolerance)) == len(lp.read_step(lens).tessellate(0.25))
    scene = lp.Scene(rays=np.int64(500))
    scene.tables["run"]["seed"] = np.uint8(7)
    scene.add(lp.point(at=np.zeros(3), power=np.float64(2)), lp.plane("wall", at=(0, 0, 1), cells=np.array([2, 2])))
    run = scene.trace(np.int32(500), threads=np.int8(1), progress=False)  # type: ignore[arg-type]
    assert run.power["emitted"] == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("change", "kind", "says"),
    [
        (lambda model: lp.study.accuracy(str(model)), TypeError, "takes a Model"),  # type: ignore[arg-type]
        (lambda model: lp.study.accuracy(model, 0.1), TypeError, r"as \[0.1\]"),  # type: ignore[arg-type]
        (lambda model: lp.study.accuracy(model, rays=0), ValueError, "rays = 0"),
        (lambda model: lp.study.accuracy(model, repetitions=0), ValueError, "repetitions = 0"),
        (lambda model: lp.study.check(model, threads=0), ValueError, "threads = 0"),
        (lambda model: lp.study.check(model, seed=-1), ValueError, "seed = -1"),
    ],
)
def test_wrong_studies_are_told_what_to_do(change: Any, kind: Any, says: str, lens: pathlib.Path) -> None:
    with pytest.raises(kind, match=says):
        change(lp.read_step(lens))


def test_wrong_materials_are_told_what_to_do() -> None:
    with pytest.raises(ValueError, match="select: say which faces"):
        lp.select()
    for medium in (None, [1.49], True):
        with pytest.raises(TypeError, match="glass: a name of"):
            lp.glass(medium)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="coating: say what it does"):
        lp.coating()
    wrong_index: Any
    for wrong_index in (("gold", 1), (1, None)):
        with pytest.raises(TypeError, match="(n|k): a number is needed"):
            lp.metal(*wrong_index)
    for key in ("index", "catalogue", "name"):
        with pytest.raises(ValueError, match=f"leave {key} out"):
            lp.glass(1.5, **{key: 1.6})
    for wrong in (3, None):
        with pytest.raises(TypeError, match="a model is needed"):
            lp.Scene(wrong)  # type: ignore[arg-type]
    reflecting: Any
    for reflecting in (lp.mirror, lp.diffuse):
        with pytest.raises(TypeError, match="reflectance = None: a share"):
            reflecting(None)


def test_a_copy_of_a_scene_goes_its_own_way() -> None:
    import copy

    scene = lamp(2000)
    first = scene.trace(progress=False)
    other = copy.deepcopy(scene)
    assert other.trace(progress=False).digest == first.digest
    other.add(lp.plane("wall", at=(0, 0, 300)))
    assert set(other.trace(progress=False)) == {"far", "wall"} and set(scene.trace(progress=False)) == {"far"}


@pytest.mark.parametrize("wrong", [None, 3, b"lamp.stp"])
def test_paths_that_are_none_are_told_what_they_must_be(wrong: Any) -> None:
    run = lamp(500).trace(progress=False)
    mesh = lp.Mesh.from_arrays(np.eye(3), [[0, 1, 2]])
    takers: list[Any] = [lp.read_step, lp.Scene.from_toml, mesh.save, lamp().save, lamp().trace_part(0, 1, rays=500).save, lp.write_demo]
    # None stands for no file there.
    takers += [run.to_json] if wrong is not None else []
    for take in takers:
        with pytest.raises(TypeError, match="a str or os.PathLike is needed, not"):
            take(wrong)


def test_missing_files_are_missing_and_input_errors(tmp_path: pathlib.Path) -> None:
    gone = tmp_path / "absent"
    mesh = lp.Mesh.from_arrays(np.eye(3), [[0, 1, 2]])
    dark = lp.Scene(LAMP).add(lp.ies(gone / "nope.ies"))
    no_model = lp.Scene(gone / "lamp.stp")
    no_catalogue = "[[medium]]\nname = 'a'\ncatalogue = 'N-BK7'\nfile = 'absent.agf'\n"
    part, run = lamp().trace_part(0, 1, rays=500), lamp(500).trace(progress=False)
    for call in (
        lambda: lp.read_step(gone / "lamp.stp"),
        lambda: lp.Scene.from_toml(gone / "lamp.toml"),
        lambda: dark.trace(progress=False),
        lambda: no_model.trace(progress=False),
        lambda: lp.Scene.parse(no_catalogue, folder=tmp_path),
        lambda: mesh.save(gone / "mesh.stl"),
        lambda: part.save(gone / "part.bin"),
        lambda: lamp().save(gone / "lamp.toml"),
        lambda: run.to_json(gone / "run.json"),
    ):
        for kind in (FileNotFoundError, lp.InputError, lp.MissingFileError):
            with pytest.raises(kind, match="absent.*(check the path|make it first|os error 2)") as missing:
                call()
            assert missing.value.errno == 2
    for call in (
        lambda: lp.read_step(tmp_path),
        lambda: lp.Scene.from_toml(tmp_path),
        lambda: mesh.save(tmp_path),
        lambda: part.save(tmp_path),
    ):
        with pytest.raises(lp.InputError, match="it is a folder; name a file in it"):
            call()
    for name in ("mesh", "mesh.xyz"):
        with pytest.raises(lp.InputError, match="names no format; use one of"):
            mesh.save(tmp_path / name)


def test_what_is_no_number_of_a_model_is_refused(lens: pathlib.Path) -> None:
    model = lp.read_step(lens)
    wrong: Any
    for wrong in (True, np.True_):
        with pytest.raises(ValueError, match="one number of mm or two"):
            model.tessellate(wrong)
    for measure in ("yes", 1, None):
        with pytest.raises(TypeError, match="measure: True or False"):
            model.tessellate(measure=measure)  # type: ignore[arg-type]
    mesh = model.tessellate(0.2)
    with pytest.raises(TypeError, match="wide: True or False"):
        lp.Bvh(mesh, wide="no")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="normals: a text is needed, not None"):
        lp.Octree(mesh, normals=None)  # type: ignore[arg-type]
    for unit in (1e-300, 1e300):
        with pytest.raises(ValueError, match="unit_mm = .* it must be from"):
            lp.read_step(lens, unit_mm=unit)
    empty = lp.Mesh.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), dtype=int))
    assert str(empty.area) == "0.0" and str(empty.volume) == "0.0"


def test_masked_and_wrong_rays_are_refused() -> None:
    mesh = lp.Mesh.from_arrays(np.eye(3), [[0, 1, 2]])
    masked = np.ma.masked_array(np.zeros((2, 3)), mask=[[False] * 3, [True] * 3])
    for given in ((masked, np.ones((2, 3))), (np.zeros((2, 3)), masked)):
        with pytest.raises(ValueError, match="some numbers are masked"):
            lp.Octree(mesh).intersect(*given)
    # A mask that masks nothing does not matter.
    assert lp.Octree(mesh).intersect(np.ma.masked_array(np.zeros((2, 3))), np.ones((2, 3))).t.shape == (2,)
    with pytest.raises(ValueError, match="some numbers are masked"):
        lp.rays(np.ma.masked_array(np.ones((1, 7)), mask=True))
    beam = np.array([[0.0, 0, 0, 0, 0, 1, 1, 550], [0, 0, 0, 0, 0, 1, 1, 0.55]])
    with pytest.raises(ValueError, match=r"rays\[1\] has the wavelength 0.55 nm: .*one in µm"):
        lp.rays(beam)
    for row, says in (
        ([0, 0, 0, 0, 0, 0, 1], r"rays\[1\] has a direction without length"),
        ([0, 0, 0, 0, 0, 1, -1], r"rays\[1\] has the power -1: it must be zero or more"),
    ):
        with pytest.raises(ValueError, match=says):
            lp.Scene().add(lp.rays([[0, 0, 0, 0, 0, 1, 1], row]))
    wrong: Any
    for wrong, says in ((np.ones((1, 3), dtype=complex), "origins.real"), ([[None] * 3], "replace what is no number")):
        with pytest.raises(TypeError, match=says):
            lp.Octree(mesh).intersect(wrong, np.ones((1, 3)))
    with pytest.raises(TypeError, match="exponent: a number"):
        lamp(500).trace(progress=False)["far"].to_png("a")  # type: ignore[arg-type]


def test_a_demo_replaces_no_file_of_another_content(tmp_path: pathlib.Path) -> None:
    scene = pathlib.Path(lp.write_demo(tmp_path))
    assert lp.write_demo(tmp_path) == str(scene)
    (tmp_path / "lamp.stp").unlink()
    scene.write_text("mine")
    with pytest.raises(FileExistsError, match=r"lamp\.toml: it is there already"):
        lp.write_demo(tmp_path)
    assert scene.read_text() == "mine" and not (tmp_path / "lamp.stp").exists()


def test_faces_are_named_by_number(lens: pathlib.Path) -> None:
    model = lp.read_step(lens)
    number = model.faces()[0]["id"]
    keys: list[Any] = [number, str(number), f"#{number}", np.int64(number)]
    counts = {len(model.tessellate(0.2, faces={key: 0.01})) for key in keys}
    assert len(counts) == 1 and counts.pop() > len(model.tessellate(0.2))


def test_tables_of_shares_are_materials() -> None:
    table: list[list[float]] = [[0, 0.1], [90, 1]]
    for material in (lp.diffuse(table), lp.diffuse(np.array(table)), lp.coating(reflectance=table), lp.mirror(table)):
        scene = lamp(500)
        scene[lp.select(part="housing", solid=0)] = material
        assert material.table["reflectance"] == table and scene.trace(progress=False).rays == 500


def test_what_is_shown_of_results(lens: pathlib.Path) -> None:
    scene = lp.Scene(rays=500).add(lp.point(at=(0, 0, 0)))
    run = scene.trace(progress=False)
    assert "500 rays, no receivers, digest" in repr(run) and run.unit == "W"
    page = lamp(500).trace(progress=False)._repr_html_()
    assert "<th>± rays</th>" in page and "<td>emitted</td><td>100</td><td>0</td><td>–</td><td>lm</td>" in page
    study = lp.study.accuracy(lp.read_step(lens), [0.4], normals=["flat"], rays=500, repetitions=1, progress=False)
    assert repr(study).startswith(f"<lampyris.Study: {len(study['normals'])} rows of model, tolerance_mm, ")


def test_what_faces_absorb_has_no_angles() -> None:
    scene = lamp(500)
    scene.add(lp.absorbed("warm", part="housing"))
    assert scene.trace(progress=False)["warm"].axis_names == ("column", "row")
