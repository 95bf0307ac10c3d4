"""Scenes built in Python, and results."""

from __future__ import annotations

import pathlib
import pickle
import threading
import time
import warnings
from typing import Any

import numpy as np
import pytest
from conftest import LAMP, ROOT, lamp

import lampyris as lp


def test_tables_that_were_kept_go_on_to_count(tmp_path: pathlib.Path) -> None:
    # A disc of radius 1 before a point that comes nearer: its share of all light is (1 - cos) / 2.
    text = """[[source]]
kind = "point"
at = [0, 0, 0]
[[receiver]]
name = "disc"
kind = "disc"
at = [0, 0, 5]
normal = [0, 0, 1]
radius = 1
"""
    scene = lp.Scene.parse(text)
    source = scene.tables["source"][0]
    for height in (0.0, 2.0, 4.0):
        source["at"] = [0, 0, height]
        share = (1 - (5 - height) / np.hypot(5 - height, 1)) / 2
        figure = scene.trace(rays=100_000, progress=False)["disc"].power
        assert figure.value == pytest.approx(share, abs=5 * figure.statistical)


def test_numbers_keep_every_bit_on_their_way_into_a_scene() -> None:
    numbers = np.random.default_rng(7).uniform(-20, 20, (1000, 3))
    scene = lp.Scene()
    for at in numbers:
        scene.tables.setdefault("source", []).append({"kind": "point", "at": at.tolist()})
    written = [float(x) for line in scene.to_toml().splitlines() if line.startswith("at = [") for x in line[6:-1].split(",")]
    assert written == numbers.ravel().tolist()


def test_ten_lines_from_a_step_file_to_candela(tmp_path: pathlib.Path) -> None:
    scene = lamp()
    assert scene.facets().sag.max() <= 0.2
    run = scene.trace(progress=False)
    far = run["far"]
    assert far.candela.shape == far.statistical.shape == (40, 80) and far.unit == "cd"
    assert far.geometric is not None and far.geometric.shape == (40, 80)
    power = run.power
    assert power["emitted"] == pytest.approx(100.0, rel=1e-12)
    parts = sum(power[k] for k in ("received", "absorbed", "escaped", "cut_off", "lost"))
    assert parts == pytest.approx(power["emitted"], rel=1e-12)
    assert far.power.statistical > 0 and far.power.unit == "lm" and "±" in str(far.power)
    with pytest.raises(ValueError, match="cd, not lx"):
        _ = far.lux
    with pytest.raises(KeyError, match="there are far"):
        _ = run["near"]
    # The light of the cells is the light that arrived: candela times solid angle.
    (h, v) = far.edges
    solid = np.outer(np.diff(np.sin(np.radians(v))), np.diff(np.radians(h)))
    assert (far.candela * solid).sum() == pytest.approx(far.power.value, rel=1e-9)
    html = run._repr_html_()
    assert "data:image/png;base64," in html and "<script" not in html
    assert run.to_json(tmp_path / "results.json").startswith("{") and (tmp_path / "results.json").exists()
    assert set(run.paths) == {"ray", "branch", "bounce", "point", "power"} and run.paths["point"].shape[1] == 3


def test_the_scene_that_was_saved_is_the_scene(tmp_path: pathlib.Path) -> None:
    scene = lamp(4000)
    scene.save(tmp_path / "lamp.toml")
    again = lp.Scene.from_toml(tmp_path / "lamp.toml")
    runs = [s.trace(intersector="octree", progress=False) for s in (scene, again)]
    assert runs[0].digest == runs[1].digest
    frame = pytest.importorskip("pandas") and runs[0].to_frame()
    assert set(frame.columns) >= {"receiver", "figure", "value", "statistical", "geometric", "unit"}
    xarray = pytest.importorskip("xarray")
    dataset = runs[0]["far"].to_xarray()
    assert isinstance(dataset, xarray.Dataset) and dataset["value"].dims == ("V", "H")
    assert dataset["value"].attrs["units"] == "cd" and dataset["H"].attrs["units"] == "deg"


def test_parts_are_left_out_of_a_model(tmp_path: pathlib.Path) -> None:
    digests = {}
    for name, without in (("none", []), ("table", [{"part": "led"}]), ("selector", [lp.select(part="led")])):
        scene = lp.Scene().add_model(LAMP, without=without)
        scene.add(lp.collimated(at=(0, 0, 120), direction=(0, 0, -1), radius=140))
        scene.save(tmp_path / "scene.toml")
        assert ("led" in (tmp_path / "scene.toml").read_text()) == bool(without)
        digests[name] = scene.trace(rays=2000, tolerance=0.5, progress=False).digest
    assert digests["table"] == digests["selector"] != digests["none"]


def test_rays_of_an_array_are_a_source() -> None:
    n = 5000
    random = np.random.default_rng(5)
    array = np.zeros((n, 7))
    array[:, :2] = random.uniform(-1, 1, (n, 2))
    array[:, 5] = 1.0
    array[:, 6] = 2.0 / n
    scene = lp.Scene(rays=4000)
    scene.add(lp.rays(array), lp.plane("wall", at=(0, 0, 10), size=(4, 4), cells=(4, 4)))
    run = scene.trace(progress=False)
    assert run.power["emitted"] == pytest.approx(2.0, rel=1e-9)
    assert run["wall"].power.value == pytest.approx(2.0, rel=1e-9)
    assert run["wall"].figures["rms_1"].value == pytest.approx(1 / np.sqrt(3), rel=0.05)
    for wrong, kind, says in [
        (np.zeros((3, 6)), ValueError, r"\(n, 7\)"),
        (np.array([["a"] * 7]), TypeError, "numbers"),
        (np.full((2, 7), np.nan), ValueError, "not finite"),
    ]:
        with pytest.raises(kind, match=says):
            lp.rays(wrong)
    with pytest.raises(ValueError, match=r"rays\[0\] has a direction without length"):
        scene.add(lp.rays(np.zeros((1, 7))))


def test_an_error_that_was_asked_for_is_reached() -> None:
    run = lamp().trace(until="1%@far", intersector="octree", progress=False)
    assert run.until is not None and run.until["reached"] and run.until["found_percent"] <= 1.0
    assert run["far"].power.statistical <= 0.01 * run["far"].power.value


def test_a_model_accounts_for_itself() -> None:
    model = lp.read_step(LAMP)
    account = model.account()
    assert account["faces"]["refused"] == 0 and account["units"]["length"]
    assert len(model.faces()) == account["faces"]["found"] and {"part", "kind", "area_mm2", "at"} <= set(model.faces()[0])
    assert "housing" in model.parts and "refused" in model._repr_html_()
    mesh = model.tessellate((0.05, 0.2), measure=True)
    assert mesh.report is not None and mesh.report["over_tolerance"] == 0
    assert mesh.sag.max() <= 0.2 and mesh.facets.shape == (len(mesh), 4) and mesh.normals.shape == (len(mesh), 4, 3)
    with pytest.raises(ValueError, match="did you mean 'housing'"):
        model.tessellate(parts={"hosing": 0.1})
    with pytest.raises(ValueError, match="unit_mm"):
        lp.read_step(LAMP, unit_mm=-1)


def test_a_lamp_gets_its_verdict() -> None:
    scene = lamp(50_000)
    scene.add(lp.far_field("fine", h_deg=(-50, 50), v_deg=(-20, 20), step_deg=0.125))
    run = scene.trace(intersector="octree", progress=False)
    name = next(iter(lp.regulations()))
    verdict = run.assess(name, "fine")
    assert verdict.verdict in ("pass", "fail", "unsure") and verdict["rows"] and verdict.traffic == "right"
    # The document of the command, and no selection of it.
    assert {"settles", "when", "note", "source", "evidence"} <= set(verdict["rows"][0]) and "gradient" in verdict["aim"]
    assert run.assess(name, "fine", left_hand=True).traffic == "left"
    assert verdict.verdict in verdict._repr_html_()
    assert run.verdicts == []
    scene.tables["regulation"] = [{"id": name, "receiver": "fine"}]
    judged = scene.trace(intersector="octree", progress=False)
    (own,) = judged.verdicts
    assert judged.document["regulations"] == [own] and "regulations" not in run.document
    assert (own["regulation"], own.verdict, own.traffic) == (name, verdict.verdict, "right")
    assert [row["value"] for row in own["rows"]] == [row["value"] for row in verdict["rows"]]
    with pytest.raises(ValueError, match="name the far field"):
        run.assess(name)
    with pytest.raises(ValueError):
        run.assess("UN R0", "fine")


def test_studies_give_arrays() -> None:
    lens = lp.read_step(ROOT / "fixtures" / "step" / "lens_planoconvex_nurbs.stp")
    study = lp.study.accuracy(lens, [0.2, 0.05], rays=2000, repetitions=1, normals=["flat", "bilinear"], progress=False)
    facets = study["intersector"] == "octree"
    assert study["direction_error_deg_rms"].dtype == float and facets.sum() >= 4 and study.answer
    bilinear = facets & (study["normals"] == "bilinear") & (study["threads"] == 1)
    errors = study["direction_error_deg_rms"][bilinear][np.argsort(study["tolerance_mm"][bilinear])]
    assert errors[0] < errors[-1]
    check = lp.study.check(lens, rays=3000, progress=False)
    assert check["rays"] == 3000 and check["octree_vs_bvh"]["disagree"] == 0
    assert check["facets_vs_exact"]["unexplained"] == 0
    with pytest.raises(TypeError, match="takes a Model"):
        lp.study.check("lens.stp")  # type: ignore[arg-type]


def test_other_threads_go_on_while_light_is_traced() -> None:
    ticks: list[float] = []
    over = threading.Event()

    def tick() -> None:
        while not over.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.005)

    other = threading.Thread(target=tick)
    other.start()
    scene = lamp(400_000)
    scene.trace(intersector="octree", progress=False)
    over.set()
    other.join()
    # A trace that held the GIL would leave one long gap.
    assert len(ticks) > 10 and np.diff(ticks).max() < 0.5 * (ticks[-1] - ticks[0])


def test_paths_are_shown_in_three_dimensions() -> None:
    pytest.importorskip("pyvista")
    run = lamp(4000).trace(intersector="octree", progress=False)
    lines = run.paths_to_pyvista()
    assert lines.n_points == len(run.paths["ray"]) and lines.n_lines > 100


def test_the_lines_of_the_readme_run(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    lp.write_demo(".")
    text = (pathlib.Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
    code = text.split("```python\n", 1)[1].split("```", 1)[0]
    names: dict[str, Any] = {}
    exec(code, names)
    assert names["run"]["far"].candela.max() > 0


def beam(folder: pathlib.Path, **run: Any) -> lp.Scene:
    """A beam of three rays onto a plane, with the models that a test adds."""
    scene = lp.Scene(LAMP, **run)
    scene.add(lp.rays(np.array([[x, 0.0, 200.0, 0.0, 0.0, 1.0, 1.0] for x in (-1.0, 0.0, 1.0)])))
    return scene.add(lp.plane("wall", at=(0, 0, 300), size=(10, 10), cells=(2, 2)))


def test_rays_of_an_array_outlive_the_process_that_saved_them(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "beam.toml"
    scene = beam(tmp_path, rays=300)
    scene.save(file)
    digest = scene.trace(progress=False).digest
    del scene
    assert lp.Scene.from_toml(file).trace(progress=False).digest == digest
    assert "lampyris-rays-" not in file.read_text()


def test_numbers_without_end_are_kept(tmp_path: pathlib.Path) -> None:
    scene = lp.Scene.parse("[run]\ncaught_after = inf\nrays = 300\n")
    assert scene.tables["run"]["caught_after"] == float("inf")
    assert "caught_after = inf" in scene.to_toml()
    assert beam(tmp_path, rays=300, caught_after=float("inf")).trace(progress=False).power["emitted"] > 0


def test_files_that_changed_are_read_again(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "rays.csv"
    file.write_text("x,y,z,dx,dy,dz,power\n0,0,200,0,0,1,1\n")
    scene = lp.Scene(LAMP, rays=300)
    scene.add(lp.ray_file(file), lp.plane("wall", at=(0, 0, 300), size=(10, 10), cells=(2, 2)))
    before = scene.trace(progress=False).power["emitted"]
    file.write_text("x,y,z,dx,dy,dz,power\n0,0,200,0,0,1,2.5\n")
    assert scene.trace(progress=False).power["emitted"] == pytest.approx(2.5 * before)


def test_media_of_the_catalogue_take_further_keys_and_all_indices_their_own_name() -> None:
    scene = lp.Scene(LAMP)
    scene["cover_PMMA"] = lp.glass("PMMA", absorption_per_mm=0.01)
    scene["housing"] = lp.glass(1.4918251)
    scene["bezel"] = lp.glass(1.4918254)
    names = [medium["name"] for medium in scene.tables["medium"]]
    assert len(set(names)) == 3 and scene.tables["medium"][0]["catalogue"] == "PMMA"
    lp.Scene.parse(scene.to_toml())


def test_cells_off_a_disc_are_none_and_dark_ones_have_the_error_of_a_ray(tmp_path: pathlib.Path) -> None:
    scene = beam(tmp_path, rays=300)
    scene.add(lp.disc("disc", at=(0, 0, 299), radius=5.0, cells=(8, 8), absorbs=False))
    disc = scene.trace(progress=False)["disc"]
    off = np.isnan(disc.values)
    assert "nan" not in disc._repr_html_().split("base64,")[0] + disc._repr_html_().split("<figcaption>")[1]
    assert off[0, 0] and off[-1, -1] and not off[4, 4]
    assert (disc.statistical[~off & (disc.values == 0)] > 0).all() and np.isnan(disc.statistical[off]).all()


def test_the_ends_of_listed_rays_and_the_light_of_faces_are_told() -> None:
    # Three rays along z: one meets the receiver, one passes it, one stands beside it and goes the other way.
    array = np.array([[0.0, 0, 0, 0, 0, 1, 1], [9.0, 0, 0, 0, 0, 1, 2], [1.0, 0, 0, 0, 0, -1, 4]])
    scene = lp.Scene(faces=3)
    scene.add(lp.rays(array), lp.plane("wall", at=(0, 0, 10), size=(4, 4), cells=(1, 1)))
    ends = scene.ends(progress=False)
    assert ends.ray.tolist() == [0, 1, 2] and ends.event.tolist() == ["received", "escaped", "escaped"]
    assert ends.power.tolist() == [1, 2, 4] and ends.face.tolist() == [-1, -1, -1]
    assert np.allclose(ends.point[0], [0, 0, 10]) and np.allclose(ends.direction, array[:, 3:6])
    assert "1 received" in repr(ends) and "2 escaped" in repr(ends)
    run = scene.trace(rays=1000, progress=False)
    assert run.faces == []
    scene = lamp(5_000)
    scene.tables["run"]["faces"] = 3
    faces = scene.trace(progress=False).faces
    assert len(faces) == 3 and {"face", "absorbed", "absorbed_error", "left"} <= set(faces[0])
    # The selector means that face and no other: a rule by it decides one.
    assert all(face["selector"] for face in faces) and len({face["selector"] for face in faces}) == 3
    scene = lp.Scene()
    scene.add(lp.point(at=(0, 0, 0)), lp.plane("wall", at=(0, 0, 10), size=(4, 4), cells=(1, 1)))
    with pytest.raises(ValueError, match="no source of this scene is a list of rays"):
        scene.ends(progress=False)


def test_rays_are_those_of_the_array_when_it_was_given() -> None:
    array = np.array([[0.0, 0, 0, 0, 0, 1, 1]])
    source = lp.rays(array)
    array[:] = 0.0
    assert source.rays is not None and source.rays.tolist() == [[0, 0, 0, 0, 0, 1, 1]]


def test_a_verdict_needs_angles_of_type_a(tmp_path: pathlib.Path) -> None:
    scene = beam(tmp_path, rays=300, unit="lm")
    scene.add(lp.far_field("b", angles="B", h_deg=(-40, 40), v_deg=(-20, 20), step_deg=1.0))
    with pytest.raises(lp.SceneError, match="angles B"):
        scene.trace(progress=False).assess(next(iter(lp.regulations())), "b")


def lens_in_beam(rays: int = 3000) -> lp.Scene:
    """A beam of 5 mm through the plano-convex lens."""
    scene = lp.Scene(ROOT / "fixtures" / "step" / "lens_planoconvex_nurbs.stp", rays=rays)
    scene["*"] = lp.glass(1.5)
    scene.add(lp.collimated(at=(0, 0, -20), direction=(0, 0, 1), radius=5))
    return scene


@pytest.mark.parametrize("channels", [{"channels": "xyz"}, {"channels": "photometric"}, {"bins_nm": [400, 500, 700]}])
def test_further_channels_leave_a_run_readable(channels: Any) -> None:
    scene = lens_in_beam()
    scene.add(lp.plane("p", at=(0, 0, 100), cells=(4, 3), **channels))
    run = scene.trace(progress=False)
    assert len(run) == 1 and "p" in repr(run["p"]) and len(run.to_frame()) > 0
    receiver = run["p"]
    assert list(receiver.channels) == list(receiver.channel_totals) and receiver.channels
    for shared in (receiver.values, *receiver.edges):
        with pytest.raises(ValueError, match="read-only"):
            shared[:] = 0.0
    for name, (cells, errors) in receiver.channels.items():
        assert cells.shape == errors.shape == (3, 4) and receiver.channel_totals[name].statistical is not None


def test_refused_faces_are_told(tmp_path: pathlib.Path) -> None:
    whole = (ROOT / "fixtures" / "step" / "lens_planoconvex_nurbs.stp").read_bytes()
    cut = tmp_path / "cut.stp"
    cut.write_bytes(whole[: len(whole) // 2])
    scene = lp.Scene(cut, rays=2000)
    scene.add(lp.collimated(at=(0, 0, -20), direction=(0, 0, 1), radius=5), lp.plane("p", at=(0, 0, 100)))
    with pytest.warns(UserWarning, match="of 3 faces were refused"):
        run = scene.trace(progress=False)
    assert "were refused" in run.notes[0]
    assert not lens_in_beam().trace(progress=False).notes


@pytest.mark.parametrize(
    ("damaged", "says"),
    [
        # The end of the file, and with it perhaps whole parts.
        (lambda text: text[: text.rindex("ENDSEC")], "ends before its end section"),
        # The units: an inch is taken for a mm.
        (lambda text: text.replace("GLOBAL_UNIT_ASSIGNED_CONTEXT", "UNKNOWN_CONTEXT"), "no unit of length is named"),
    ],
    ids=["cut off", "without units"],
)
def test_what_could_not_be_read_is_told_before_light_is_traced(damaged: Any, says: str, tmp_path: pathlib.Path) -> None:
    whole = (ROOT / "fixtures" / "step" / "lens_planoconvex_nurbs_inch.stp").read_text()
    file = tmp_path / "damaged.stp"
    file.write_text(damaged(whole))
    with pytest.warns(UserWarning, match=says):
        model = lp.read_step(file)
    for of in (model, file):
        scene = lp.Scene(of, rays=500).add(lp.point(at=(0, 0, -30)), lp.plane("p", at=(0, 0, 100)))
        with pytest.warns(UserWarning, match=says):
            run = scene.trace(progress=False)
        assert any(says in note for note in run.notes)
    stages: list[str] = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Raised as errors they cost no light.
        with pytest.raises(UserWarning):
            scene.trace(rays=501, progress=lambda stage, *_: stages.append(stage))
    assert "tracing" not in stages


def test_lost_light_is_warned_of_and_its_run_kept() -> None:
    # All light starts within a closed solid that lets none through.
    scene = lp.Scene(ROOT / "fixtures" / "step" / "lens_planoconvex_nurbs.stp", rays=500)
    scene["*"] = lp.absorber()
    scene.add(lp.point(at=(0, 0, 2), inside=[]), lp.plane("p", at=(0, 0, 100)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(lp.LostLightWarning, match="100 % of the energy was lost") as caught:
            scene.trace(progress=False)
    run = caught.value.run
    assert run.power["lost"] == run.power["emitted"] == pytest.approx(1.0)
    assert pickle.loads(pickle.dumps(caught.value)).run.digest == run.digest


def test_light_starts_on_faces_and_faces_are_selected_by_their_solid() -> None:
    scene = lens_in_beam()
    solid = lp.select(solid="*")
    scene.add(lp.cone(on=solid, half_angle_deg=20), lp.lambertian(on={"part": "*"}))
    assert [source.get("on") for source in scene.tables["source"][1:]] == [{"solid": "*"}, {"part": "*"}]
    assert lp.select(layer="0", kind="plane", radius_mm=3.0).table == {"layer": "0", "kind": "plane", "radius_mm": 3.0}
    with pytest.raises(TypeError, match="leave `at` and `direction` out"):
        lp.cone(at=(0, 0, 0), direction=(0, 0, 1), half_angle_deg=20, on=solid)
    with pytest.raises(TypeError, match="say where light starts"):
        lp.lambertian()
