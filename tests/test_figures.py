# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What small runs of benchmarks find is what the README and the first tables of the pages have."""

import csv
import shutil
import subprocess

import numpy as np
import pytest

import benchmarks
from benchmarks import accuracy
from tools import figures

SHAPES, POINTS = 16, 4
ALIKE = {accuracy.CUBIC: "mean / cubic's", accuracy.PROCESS: "mean / process's"}


def cell(head, row, column):
    """A cell of a table that benchmarks.accuracy has printed."""
    rows = figures.printed("accuracy", head)
    (found,) = (each for each in rows[2:] if each[0] == row)
    return found[rows[0].index(column)]


@pytest.mark.parametrize("method", [accuracy.BAYES, accuracy.CUBIC])
@pytest.mark.parametrize("planes", accuracy.EXACT_PLANES)
def test_without_noise_the_errors_on_exact_surfaces_are_those_of_the_table(method, planes):
    cases = [accuracy.exact_case(name, planes, 0.0, i) for i, name in enumerate(accuracy.SURFACES)]
    found = np.median([accuracy.score(accuracy.METHODS[method](case), case).error for case in cases])
    assert found == pytest.approx(float(cell("method | 0/60/120, 0", method, f"{planes}, 0")), abs=0.6)


@pytest.mark.long
def test_the_errors_on_random_shapes_are_those_of_the_readme_within_their_noise():
    scores = [accuracy.random_scores(seed) for seed in range(SHAPES)]

    def means(method, measure):
        """The mean (SHAPES,) over the sets of planes, by shape."""
        return np.array([np.mean([getattr(s[method], measure) for s in of.values()]) for of in scores])

    ours = means(accuracy.BAYES, "error")
    for method in (m for m in accuracy.SHAPE_METHODS if m in ALIKE):
        theirs = means(method, "error")
        ratio = ours.mean() / theirs.mean()
        noise = np.std(ours - ratio * theirs) / theirs.mean() / np.sqrt(SHAPES)
        assert float(cell("planes | median", "all", ALIKE[method])) == pytest.approx(ratio, abs=3.0 * noise)
    covered = 100.0 * means(accuracy.BAYES, "covered")
    told = float(cell("planes | median", "all", "covered").split()[0])
    assert told == pytest.approx(covered.mean(), abs=3.0 * covered.std() / np.sqrt(SHAPES))


@pytest.mark.long
def test_the_figures_of_scans_are_those_of_the_readme_within_their_noise(scans):
    pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
    from benchmarks import real

    objects = [real.Scan(path) for path in benchmarks.scan_files()]
    cells = [real.fixed_scores(scan, POINTS, {real.OURS: real.ours})[0] for scan in objects]
    covered = np.array([np.mean([of[real.OURS].covered for of in found.values()]) for found in cells])
    rows = figures.printed("real", "planes | extent")
    told = np.mean([float(row[rows[0].index("within, bayes")]) for row in rows[2:]])
    assert told == pytest.approx(covered.mean(), abs=3.0 * covered.std() / np.sqrt(len(covered)))
    found = np.sum([real.automatic_row(scan, POINTS)[:7] for scan in objects], axis=0)
    head, *_, total = figures.printed("real", "scan | sure")
    numbers = np.array(total[1:8], dtype=float)
    touches, shares = found[:3].sum(), numbers / numbers[:3].sum()
    for name in ("sure", "sure, off > 2 %", "turned"):
        i = head.index(name) - 1
        noise = np.sqrt(shares[i] * (1.0 - shares[i]) * touches)
        assert found[i] == pytest.approx(shares[i] * touches, abs=3.0 * noise + 1e-9), name


def test_a_benchmark_without_scans_says_where_they_are_from(tmp_path, monkeypatch):
    monkeypatch.setattr(benchmarks, "SCANS_FOLDER", tmp_path)
    with pytest.raises(
        SystemExit, match=r"benchmarks/SCANS.md lists into one folder, and name it by TACTILE"
    ):
        benchmarks.scan_files()
    for name in ("pear.ply", "cad_block.stl"):
        (tmp_path / name).touch()
    assert [path.name for path in benchmarks.scan_files("cad")] == ["cad_block.stl"]


def test_figures_that_are_kept_do_not_make_the_code_a_later_one(tmp_path, monkeypatch):
    if shutil.which("git") is None:
        pytest.skip("needs git")

    def git(*words):
        author = ("-c", "user.name=a", "-c", "user.email=a@b")
        subprocess.run(["git", *author, *words], cwd=tmp_path, check=True, capture_output=True)

    (tmp_path / "docs").mkdir()
    for name in ("code.py", "docs/figure.txt"):
        (tmp_path / name).write_text("old")
    git("init")
    git("add", "--all")
    git("commit", "--message", "old")
    monkeypatch.setattr(benchmarks, "ROOT", tmp_path)
    (tmp_path / "docs" / "figure.txt").write_text("new")
    head = benchmarks.commit()
    assert len(head) >= 7 and "later" not in head
    (tmp_path / "code.py").write_text("new")
    assert benchmarks.commit() == f"later than {head}"


def test_nothing_in_the_chart_is_nearer_with_the_same_curves_and_little_is_faster():
    text = (figures.DOCS / "charts" / "speed_accuracy.csv").read_text(encoding="utf-8")
    rows = list(csv.DictReader(text.splitlines()[1:]))
    for noise in {row["noise mm"] for row in rows}:
        fits = [r for r in rows if r["noise mm"] == noise and "(hollow)" not in r["meaning"]]
        (default,) = (row for row in fits if row["method"] == "auto")
        best = min(float(row["um median"]) for row in fits if row["um median"] != "nan")
        assert float(default["um median"]) == best
        assert float(default["ms median"]) - min(float(row["ms median"]) for row in fits) < 1.0
