"""The programs of python/examples run; here with few steps."""

import runpy
import sys
from pathlib import Path

import pytest

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


def test_train_mark_plot_compiles():
    """It renders some hundred views, minutes of work: too long for a test."""
    source = (EXAMPLES / "train_mark_plot.py").read_text()
    compile(source, "train_mark_plot.py", "exec")  # raises SyntaxError


def test_compare_step_says_how_to_use_it():
    with pytest.raises(SystemExit, match=r"usage: compare_step.py FIT_IMAGE \[TURNS\]"):
        run("compare_step.py")
