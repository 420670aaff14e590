"""The programs of python/examples run; here with few steps."""

import inspect
import runpy
import sys
from pathlib import Path

import pytest

import fieldmark as fm

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"


def run(name, *arguments):
    before, sys.argv = sys.argv, [name, *map(str, arguments)]
    try:
        runpy.run_path(str(EXAMPLES / name))
    finally:
        sys.argv = before


def test_fit_image_runs_and_learns(capsys):
    run("fit_image.py", 100)
    lines = capsys.readouterr().out.splitlines()
    assert float(lines[-1].split()[1]) > 20 and "ms a step" in lines[-1]


def test_train_mark_plot_runs(scene, field, owner, marked, tmp_path, monkeypatch, capsys):
    """Every line but the minutes of training, whose results are those of the other tests."""
    pytest.importorskip("matplotlib", reason="python3-matplotlib is missing")
    steps = []
    for name, result in (("train", field), ("embed", owner), ("bake", marked)):
        def call(*arguments, signature=inspect.signature(getattr(fm, name)), result=result, **options):
            signature.bind(*arguments, **options)
            steps.append(options["steps"])
            return result

        monkeypatch.setattr(fm, name, call)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    monkeypatch.chdir(tmp_path)
    run("train_mark_plot.py", scene, 2)
    out = capsys.readouterr().out
    assert steps == [2, 2, 2] and "test views:" in out and "p-value, unmarked:" in out
    assert (tmp_path / "mark.png").read_bytes().startswith(b"\x89PNG")


def test_compare_step_says_how_to_use_it():
    with pytest.raises(SystemExit, match=r"usage: compare_step.py FIT_IMAGE \[TURNS\]"):
        run("compare_step.py")
