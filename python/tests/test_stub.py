"""The stub names what the module has, with the same arguments and defaults, and keeps the scalar types apart."""

import ast
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from fieldmark import _fieldmark, engine

STUB = Path(_fieldmark.__file__).with_name("_fieldmark.pyi")
TREE = ast.parse(STUB.read_text())
CLASSES = {node.name: node for node in TREE.body if isinstance(node, ast.ClassDef)}
FUNCTIONS = {node.name: node for node in TREE.body if isinstance(node, ast.FunctionDef)}
MADE_BY_PYBIND = {"__init__", "__doc__", "__module__", "__new__", "__hash__", "__repr__", "__eq__", "__array_ufunc__",
                  "__getstate__", "__setstate__", "__reduce__"}
NOT_MADE_BY_USERS = {"Field", "GradcheckReport", "Key", "OpCost", "Owner", "Value_float32", "Value_float64"}


def name_of(base):
    return base.value.id if isinstance(base, ast.Subscript) else base.id


def members(name):
    """The functions of a class in the stub, those of its private bases included."""
    found = {}
    for base in CLASSES[name].bases:
        if name_of(base).startswith("_"):
            found.update(members(name_of(base)))
    found.update({node.name: node for node in CLASSES[name].body if isinstance(node, ast.FunctionDef)})
    return found


def is_property(node):
    return any(isinstance(d, ast.Name) and d.id == "property" for d in node.decorator_list)


def signature(node):
    """[(argument, default or ...)] of a function in the stub, without self and *args."""
    arguments = [a.arg for a in node.args.args]
    values = [...] * (len(arguments) - len(node.args.defaults)) + [ast.literal_eval(d) for d in node.args.defaults]
    return [(a, v) for a, v in zip(arguments, values) if a != "self"]


def bound_signature(name, function):
    """The same of a bound function, from the first signature in its text."""
    text = re.search(rf"^(?:1\. )?{name}\((.*)\) ->", function.__doc__, re.MULTILINE).group(1)
    found = []
    for part in re.split(r", (?=\w+: |\*)", text):
        match = re.match(r"(\w+)(?:: (?:[^=]|=(?! ))*?)?(?: = (.+))?$", part)
        if match and match.group(1) not in ("self", ""):
            default = match.group(2)
            found.append((match.group(1), ... if default is None else ast.literal_eval(default)))
    return found


def public(names):
    return {n for n in names if not n.startswith("_")}


def test_every_public_name_is_in_the_stub_and_no_other():
    assert public(dir(_fieldmark)) == public(CLASSES) | public(FUNCTIONS)


def test_the_engine_exports_all_but_fields_marks_and_errors():
    others = {"Camera", "Error", "Field", "IoError", "Key", "Owner", "ShapeError", "ValueError_", "bake", "embed",
              "set_threads", "threads", "train"}
    assert public(dir(_fieldmark)) - set(engine.__all__) == others
    assert all(hasattr(engine, name) for name in engine.__all__)


@pytest.mark.parametrize("name", sorted(public(FUNCTIONS)))
def test_functions_have_the_arguments_of_the_stub(name):
    assert signature(FUNCTIONS[name]) == bound_signature(name, getattr(_fieldmark, name))


@pytest.mark.parametrize("name", sorted(public(CLASSES)))
def test_classes_have_the_members_of_the_stub(name):
    bound, stubbed = getattr(_fieldmark, name), members(name)
    if issubclass(bound, Exception):
        return
    assert set(vars(bound)) - MADE_BY_PYBIND == set(stubbed) - MADE_BY_PYBIND
    for member, node in stubbed.items():
        if is_property(node):
            assert isinstance(vars(bound)[member], property), member
        elif member == "__init__" and name in NOT_MADE_BY_USERS:
            assert ast.unparse(node.args.args[1].annotation) == "Never"
            with pytest.raises(TypeError, match="No constructor defined"):
                bound()
        elif member not in ("__exit__", "__hash__"):
            assert signature(node) == bound_signature(member, getattr(bound, member)), member


def test_classes_of_the_two_scalar_types_share_private_bases_only():
    for name in CLASSES:
        if name.endswith(("_float32", "_float64")):
            assert all(name_of(base).startswith("_") for base in CLASSES[name].bases), name


def test_a_type_checker_refuses_mixed_types(tmp_path):
    if importlib.util.find_spec("mypy") is None:
        pytest.skip("mypy is missing")
    program = tmp_path / "program.py"
    program.write_text("""import numpy as np
import fieldmark as fm
from fieldmark import engine
tape, other = engine.Tape(), engine.Tape("float64")
x, y = tape.constant(np.ones(3, np.float32)), other.constant(np.ones(3))
z = engine.minimum(x * 2.0, x) + x
x + y  # refused
engine.minimum(x, y)  # refused
engine.Adam(engine.Parameters("float64")).step()
engine.Parameters().leaf(other, "w")  # refused
reveal = float(x), x < 1.0, bool(engine.gradcheck(engine.square, [np.ones(3)]))
fm.Field()  # refused
fm.Key()  # refused
""")
    checked = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path), str(program)],
                             env={**os.environ, "MYPYPATH": str(STUB.parent.parent)}, capture_output=True, text=True)
    refused = [i for i, line in enumerate(program.read_text().splitlines(), 1) if line.endswith("# refused")]
    assert sorted({int(n) for n in re.findall(r"program\.py:(\d+): error", checked.stdout)}) == refused, checked.stdout
