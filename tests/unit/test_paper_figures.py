"""The figures hold the data, stay drawable in odd cases, and come out the same twice."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest

from rampe_guard.evaluate.paper_estimates import Run, judge
from rampe_guard.evaluate.paper_figures import figure5, figure8, figure9
from rampe_guard.evaluate.paper_plot import category_style, save, style
from tests.support.paper import made_experiment, made_run, two_blobs

LIMITS = np.array([[-90.0, 90.0], [2.3, 3.2]])


def judged(count: int = 30) -> Run:
    category, start, x = two_blobs(np.random.default_rng(1), count)
    return judge(1, made_run(category, start, x).primitives, LIMITS)


def test_figure_8_shows_where_each_primitive_began_and_ended() -> None:
    run = judged()
    axes = figure8(made_experiment(), run, "default").axes[0]
    clouds = [line.get_xydata() for line in axes.lines if line.get_linestyle() == "None"]
    start = run.primitives.start[3:]
    wanted = (
        start,
        start + run.primitives.displacement[3:],
        start + run.estimate["default"][3:],
    )
    assert len(clouds) == 3
    for cloud, points in zip(clouds, wanted, strict=True):
        np.testing.assert_allclose(np.asarray(cloud), points)


def test_figure_9_shows_the_error_by_occurrence_and_marks_what_is_beyond() -> None:
    run = judged()
    run.estimate["faithful"][10, 1] = 7.0  # metres
    error = run.error("faithful")[:, 1]
    axes = figure9(made_experiment(), run, "faithful").axes[1]
    k, shown = np.asarray(axes.lines[1].get_xydata()).T
    assert k.tolist() == list(range(1, 31))
    low, high = axes.get_ylim()
    assert shown[10] == pytest.approx(low, abs=0.1 * (high - low))
    np.testing.assert_allclose(np.delete(shown, 10), np.delete(error, 10), atol=1e-9)
    assert [t.get_text() for t in axes.texts] == [f"{error[10]:.3g}"]


def test_a_run_without_enough_of_anything_can_be_drawn(tmp_path: Path) -> None:
    few = judge(1, judged(2).primitives, LIMITS)
    with style():
        save(figure8(made_experiment(), few, "faithful"), tmp_path, "eight")
        save(figure9(made_experiment(), few, "faithful"), tmp_path, "nine")
    assert all((tmp_path / f"{n}.png").stat().st_size > 5000 for n in ("eight", "nine"))


def test_the_same_figure_is_the_same_file_whatever_the_users_style(tmp_path: Path) -> None:
    for name, colour in (("one", "red"), ("two", "green")):
        (tmp_path / name).mkdir()
        with mpl.rc_context({"axes.facecolor": colour}), style():
            save(figure5(made_experiment()), tmp_path / name, "figure5")
        assert mpl.rcParams["axes.facecolor"] == "white"
    for ending in ("png", "svg"):
        one, two = (tmp_path / name / f"figure5.{ending}" for name in ("one", "two"))
        assert one.read_bytes() == two.read_bytes()


def test_no_two_categories_look_alike() -> None:
    categories = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if (a, b) != (0, 0)]
    colours, marks = zip(*(category_style(c) for c in categories), strict=True)
    assert len(set(colours)) == len(set(marks)) == 8
