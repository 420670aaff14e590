"""Builds the extension module with the project's own CMake files."""

import os
import re
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

INCLUDES = [Path("/usr/include"), Path("/usr/local/include")]
ROOT = Path(__file__).resolve().parent.parent


class CMakeBuild(build_ext):
    def build_extension(self, extension: Extension) -> None:
        target = Path(self.get_ext_fullpath(extension.name)).resolve().parent
        build = Path(self.build_temp).resolve()
        subprocess.check_call(
            ["cmake", "-S", str(ROOT), "-B", str(build), "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
             "-DCMAKE_UNITY_BUILD=ON", "-DFIELDMARK_BUILD_PYTHON=ON", "-DFIELDMARK_BUILD_TESTS=OFF",
             "-DFIELDMARK_BUILD_TOOLS=OFF", "-DFIELDMARK_INSTALL=OFF", f"-DPython_EXECUTABLE={sys.executable}",
             f"-DFIELDMARK_PYTHON_OUTPUT={target}"])
        subprocess.check_call(["cmake", "--build", str(build), "--target", "_fieldmark", "--parallel",
                               str(os.cpu_count() or 1)])


def pybind11_version() -> tuple[int, int]:
    """Version of pybind11, from its package or from the headers of the system; (0, 0): not found."""
    folders = list(INCLUDES)
    try:
        import pybind11
        folders.insert(0, Path(pybind11.get_include()))
    except ImportError:
        pass
    for folder in folders:
        header = folder / "pybind11" / "detail" / "common.h"
        if header.exists():
            found = dict(re.findall(r"#define PYBIND11_VERSION_(MAJOR|MINOR) (\d+)", header.read_text()))
            return int(found["MAJOR"]), int(found["MINOR"])
    return 0, 0


# Before version 2.12, pybind11 reads NumPy 1's layout of dtypes.
setup(install_requires=["numpy" if pybind11_version() >= (2, 12) else "numpy<2"],
      ext_modules=[Extension("fieldmark._fieldmark", sources=[])], cmdclass={"build_ext": CMakeBuild})
