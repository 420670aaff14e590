"""What `pip install ./python` would install, without the minutes of the build."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parent.parent


BUILD = """
import runpy, sys
from setuptools import build_meta
build_meta.prepare_metadata_for_build_wheel("metadata")
sys.argv = ["setup.py", "-q", "build_py", "--build-lib", "lib"]
runpy.run_path("setup.py", run_name="__main__")
"""


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A copy of the project with the metadata of its wheel, and the modules but for the extension."""
    folder = tmp_path_factory.mktemp("project")
    for name in ("pyproject.toml", "setup.py", "README.md"):
        shutil.copy(SOURCE / name, folder)
    shutil.copytree(SOURCE / "fieldmark", folder / "fieldmark")
    (folder / "metadata").mkdir()
    done = subprocess.run([sys.executable, "-c", BUILD], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder


def test_a_wheel_has_the_version_and_needs_of_the_project(project):
    metadata, = (project / "metadata").glob("*.dist-info/METADATA")
    cmake = (SOURCE.parent / "CMakeLists.txt").read_text()
    version = re.search(r"^project\(fieldmark VERSION (\S+)", cmake, re.MULTILINE).group(1)
    text = metadata.read_text()
    assert f"\nName: fieldmark\nVersion: {version}\n" in text
    assert re.search(r"^Requires-Dist: numpy(?: ?\(?<2\)?)?$", text, re.MULTILINE) and "\nRequires-Python: >=3.9" in text


def test_a_wheel_has_the_modules_and_their_types(project):
    installed = {path.name for path in (project / "lib" / "fieldmark").iterdir()}
    assert installed == {"__init__.py", "_refusal.py", "engine.py", "_fieldmark.pyi", "py.typed"}


def test_a_module_that_reads_the_layout_of_numpy_1_refuses_numpy_2(project):
    metadata, = (project / "metadata").glob("*.dist-info/METADATA")
    needs_1 = re.search(r"^Requires-Dist: numpy.*<2", metadata.read_text(), re.MULTILINE)
    program = "import numpy; numpy.__version__ = '2.1.0'; import fieldmark"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    if needs_1:
        assert "ImportError: [fieldmark] this build needs NumPy 1, got 2.1.0: install \"numpy<2\"" in done.stderr
    else:
        assert done.returncode == 0, done.stderr
