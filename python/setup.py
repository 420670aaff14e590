"""Builds the extension module with the project's own CMake files."""

import os
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

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


setup(ext_modules=[Extension("fieldmark._fieldmark", sources=[])], cmdclass={"build_ext": CMakeBuild})
