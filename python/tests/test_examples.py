"""The programs of python/examples run; here with few steps."""

import importlib.util
import os
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


@pytest.fixture(scope="module")
def marked(scene, tmp_path_factory):
    """The folder in which train_mark_plot.py ran, and what it printed."""
    folder = tmp_path_factory.mktemp("marked")
    before = os.getcwd()
    os.chdir(folder)
    with pytest.MonkeyPatch.context() as patch:
        printed = []
        patch.setattr("builtins.print", lambda *words, **_: printed.append(" ".join(map(str, words))))
        try:
            run("train_mark_plot.py", scene, 20)
        finally:
            os.chdir(before)
    return folder, printed


def test_train_mark_plot_reads_a_message_back(marked):
    printed = "\n".join(marked[1])
    for said in ("test views:", "read: ", "p-value, marked:", "p-value, unmarked:", "PSNR of marked"):
        assert said in printed


def test_train_mark_plot_plots(marked):
    if importlib.util.find_spec("matplotlib") is None:
        assert marked[1][-1].startswith("no plot")
        pytest.skip("python3-matplotlib is missing: no plot")
    assert (marked[0] / "mark.png").stat().st_size > 1000
