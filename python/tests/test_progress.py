"""What is shown of the stages of a job."""

from __future__ import annotations

import pathlib
from typing import Any

import pytest
from conftest import ROOT

import lampyris as lp
from lampyris.progress import Progress


class Bar:
    """Takes the place of tqdm's, and remembers all that were made."""

    made: list[Bar] = []

    def __init__(self, total: int, desc: str, leave: bool, unit: str = "it", unit_scale: bool = False, bar_format: str = "") -> None:
        self.total, self.desc, self.unit, self.format = total, desc, unit, bar_format
        self.n, self.is_closed = 0, False
        Bar.made.append(self)

    def update(self, n: int) -> None:
        assert n >= 0
        self.n += n

    def reset(self, total: int) -> None:
        self.n, self.total = 0, total

    def close(self) -> None:
        self.is_closed = True


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> Progress:
    monkeypatch.setattr(Bar, "made", [])
    progress = Progress()
    progress._tqdm = Bar
    return progress


def test_a_stage_that_learns_its_total_late_has_a_bar(shown: Progress) -> None:
    shown("aiming", 0, 0, [])
    assert not Bar.made
    shown("aiming", 0, 1000, [])
    shown("aiming", 300, 1000, [])
    (bar,) = Bar.made
    assert (bar.desc, bar.n, bar.total) == ("aiming", 300, 1000)
    # Thousandths are no rays: the percentage alone is shown.
    assert "rays" not in bar.unit and "n_fmt" not in bar.format and "{l_bar}" in bar.format
    shown("building", 0, 0, [])
    assert bar.is_closed and len(Bar.made) == 1


def test_a_stage_without_a_name_has_a_bar(shown: Progress) -> None:
    shown("", 5, 10, [])
    assert [bar.n for bar in Bar.made] == [5]


def test_rays_are_counted_while_they_are_traced(shown: Progress) -> None:
    for stage in ("tracing", "checking"):
        shown(stage, 0, 2000, [])
        shown(stage, 500, 2000, [])
        assert (Bar.made[-1].unit, Bar.made[-1].n, Bar.made[-1].format) == (" rays", 500, "")
    assert [bar.desc for bar in Bar.made] == ["tracing", "checking"]
    shown.close()
    assert all(bar.is_closed for bar in Bar.made)


def test_a_run_that_goes_on_with_more_rays_shows_them(shown: Progress, capsys: pytest.CaptureFixture[str]) -> None:
    shown("tracing", 900, 1000, [])
    shown("tracing", 1000, 1000, ["2.50 %: going on with 8000 rays"])
    assert capsys.readouterr().err == "2.50 %: going on with 8000 rays\n" and Bar.made[0].is_closed
    shown("tracing", 100, 8000, [])
    bar = Bar.made[-1]
    assert (bar.n, bar.total, bar.is_closed) == (100, 8000, False)
    # Without a message in between, too.
    shown("tracing", 50, 9000, [])
    assert (bar.n, bar.total) == (50, 9000)


@pytest.mark.parametrize("kind", ["accuracy", "interpolation", "check"])
def test_a_study_tells_how_far_it_is(kind: str, lens: pathlib.Path) -> None:
    told: list[tuple[str, int, int]] = []

    def tell(stage: str, done: int, total: int, messages: list[str]) -> None:
        told.append((stage, done, total))

    model = lp.read_step(lens)
    if kind == "accuracy":
        lp.study.accuracy(model, [0.4], normals=["flat"], rays=2000, repetitions=1, progress=tell)
    elif kind == "interpolation":
        lp.study.interpolation(model, rays=500, repetitions=4, progress=tell)
    else:
        lp.study.check(model, rays=2000, progress=tell)
    shares = [done for _, done, _ in told]
    assert shares == sorted(shares)
    name = {"accuracy": "accuracy study", "interpolation": "interpolation study", "check": "cross-check"}[kind]
    assert {stage for stage, _, _ in told} <= {"", name}
    stage, done, total = told[-1]
    assert stage == name and 0 <= done <= total == 1000


def test_how_a_scene_is_traced_is_told_in_the_words_of_the_command() -> None:
    said: list[str] = []
    scene = lp.Scene.from_toml(ROOT / "fixtures" / "scenes" / "demo.toml")
    run = scene.trace(rays=100_000, progress=lambda stage, done, total, messages: said.extend(messages))
    assert run.chosen is not None
    how = "on the spline"
    if run.chosen["intersector"] != "exact":
        is_moved = run.chosen["normals"] == "exact"
        how = "mm with hits moved to the spline" if is_moved else f"mm with {run.chosen['normals']} normals"
    assert [message for message in said if message.startswith("tracing on") and f"{how}: {run.chosen['because']}" in message]


def test_a_scene_without_a_surface_is_traced_on_none() -> None:
    said: list[str] = []
    scene = lp.Scene.parse("[run]\nrays = 300\n[[source]]\nkind = 'point'\n")
    scene.trace(progress=lambda stage, done, total, messages: said.extend(messages))
    assert "there is no model, and nothing is met" in said and not any("facets" in message for message in said)


def test_tqdm_takes_what_it_is_given() -> None:
    tqdm: Any = pytest.importorskip("tqdm")
    progress = Progress()
    progress._tqdm = tqdm.tqdm
    for stage, unit in (("aiming", "["), ("tracing", "rays")):
        progress(stage, 0, 0, [])
        progress(stage, 0, 1000, [])
        bar = progress._bar
        progress(stage, 500, 1000, [])
        assert f"{stage}:  50%" in str(bar) and unit in str(bar)
        assert (" rays" in str(bar)) == (stage == "tracing")
        progress(stage, 10, 4000, [])
        assert (bar.n, bar.total) == (10, 4000)
    progress.close()
    assert progress._bar is None
