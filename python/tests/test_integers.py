"""Integers out of range: one error, which names the argument, the value and the range."""

import inspect
import re

import numpy as np
import pytest

import fieldmark as fm
from fieldmark import _fieldmark, engine

WIDE = "0 to 9223372036854775807"
SEED = "0 to 18446744073709551615"
TAPE = engine.Tape("float64")
ROWS = TAPE.constant(np.ones((4, 6)))
IMAGE = TAPE.constant(np.ones((1, 4, 4, 2)))
KERNEL, BIAS = TAPE.constant(np.ones((3, 3, 2, 2))), TAPE.constant(np.ones(2))
INDEX = np.arange(4, dtype="int32")
MODEL = engine.Parameters("float64")
OBJECTS = {
    "n": 1, "steps": 2, "every": 2, "seconds": 1.0, "factor": 0.5, "x": IMAGE, "w": KERNEL, "b": BIAS, "gamma": BIAS,
    "beta": BIAS, "xs": [IMAGE, IMAGE], "axis": 1, "before": 0, "after": 0, "begin": 0, "count": 1, "index": INDEX,
    "extent": 4, "size": 2, "height": 4, "width": 4, "shape": [32], "order": [0, 1, 2, 3], "p": 0.5, "seed": 1,
    "step": 1, "parameters": MODEL, "name": "layer", "inputs": 2, "outputs": 2, "relu": False, "kernel": 3,
    "channels": 8, "groups": 1, "eps": 1e-5, "pose": np.eye(4), "fov": 0.7, "total": 3, "replanned": False,
    "data": "nowhere", "progress": None, "owner": None, "message": "0", "field": None, "key": None, "bits": 4,
    "mark_psnr": None, "views": 8}
OF_FILES = {"train", "embed", "bake", "Field.cameras", "Field.evaluate"}  # of the module, checked in __init__.py or below


def signature(function, name):
    """[(argument, kind)] from the text of the first overload."""
    text = re.search(rf"^(?:1\. )?{name}\((.*)\) ->", function.__doc__ or "", re.MULTILINE)
    parts = [part.partition(": ") for part in re.split(r", (?=\w+: )", text.group(1))] if text else []
    return [(argument, re.sub("^Optional\\[(.*)\\]$", r"\1", kind.partition(" = ")[0]).replace("list[", "List["))
            for argument, _, kind in parts if argument not in ("", "self")]


def callables():
    """name -> (function, arguments) of all functions, constructors and methods that take an integer."""
    found = {}
    for name, thing in vars(_fieldmark).items():
        if inspect.isbuiltin(thing) and not name.startswith("_"):
            found[name] = (thing, signature(thing, name))
        elif inspect.isclass(thing) and not issubclass(thing, Exception) and not name.endswith("_float32"):
            for method in vars(thing):
                if not method.startswith("__") or method == "__init__":
                    bound = getattr(thing, method)
                    if callable(bound):
                        plain = name.partition("_float")[0]
                        key = plain if method == "__init__" else f"{plain}.{method}"
                        found[key] = (thing if method == "__init__" else bound, signature(bound, method))
    return {name: (function, arguments) for name, (function, arguments) in found.items()
            if any(kind in ("int", "List[int]") for _, kind in arguments)}


CALLS = {(name, argument): (function, arguments, kind) for name, (function, arguments) in callables().items()
         for argument, kind in arguments if kind in ("int", "List[int]")}


def range_of(name, argument):
    if argument in ("seed", "step", "stream"):
        return SEED
    return "-5 to 4" if argument in ("axis", "order") or name == "transpose" else WIDE


def call(name, argument, given):
    """Calls a function with one argument replaced."""
    function, arguments, kind = CALLS[name, argument]
    values = {a: OBJECTS.get(a) for a, _ in arguments if a in OBJECTS}
    values[argument] = [given] if kind == "List[int]" else given
    if name.startswith("Schedule."):
        return function(engine.Schedule(steps=5), **values)
    if name.startswith("Camera."):
        return function(fm.Camera(np.eye(4), 0.7, 8, 8), **values)
    if name == "Schedule":
        del values["seconds"]
    return function(**values)


def test_the_search_finds_the_integers():
    names = {name for name, _ in CALLS}
    assert {"conv2d", "conv_transpose2d", "dropout", "Dense", "Embedding", "Schedule.lr", "Camera", "pad"} <= names
    assert len(CALLS) > 55


@pytest.mark.parametrize("name, argument", [key for key in sorted(CALLS) if key[0] not in OF_FILES])
@pytest.mark.parametrize("given", [2 ** 70, -2 ** 70])
def test_an_integer_beyond_its_type_is_named_with_its_range(name, argument, given):
    place = r"(\[0\])?" if CALLS[name, argument][2] == "List[int]" else ""
    text = rf"^\[{name}\] {argument}{place} must be {range_of(name, argument)}, got {given}$"
    with pytest.raises(ValueError, match=text):
        call(name, argument, given)


@pytest.mark.parametrize("name, argument", [key for key in sorted(CALLS) if key[0] not in OF_FILES])
@pytest.mark.parametrize("given", [2 ** 63 - 1, 2 ** 40, -1, -2 ** 63])
def test_an_integer_that_cannot_be_is_never_taken_for_another(name, argument, given):
    free = argument in ("seed", "step", "stream") or (name, argument) in {
        ("cosine_decay", "n"), ("cosine_decay", "steps"), ("step_decay", "n"), ("step_decay", "every"),
        ("exponential_decay", "n"), ("warm_up", "n"), ("warm_up", "steps")}
    if given == -1 and range_of(name, argument) == "-5 to 4" or given > 0 and free:
        return  # an axis counted from the last; any number of 64 bits
    with pytest.raises((ValueError, MemoryError)) as raised:
        call(name, argument, given)
    if raised.type is not MemoryError:
        assert str(given) in str(raised.value) and str(raised.value).startswith("["), raised.value
    assert len(MODEL.names()) == 0


@pytest.mark.parametrize("axis, text", [
    (2 ** 70, rf"axis must be -5 to 4, got {2 ** 70}"), (2 ** 40, rf"axis must be -5 to 4, got {2 ** 40}"),
    ([0, -2 ** 70], rf"axis\[1\] must be -5 to 4, got {-2 ** 70}")])
def test_axes_of_reductions_are_named_with_their_range(axis, text):
    for name in ("sum", "mean", "variance", "max", "logsumexp"):
        with pytest.raises(fm.ShapeError, match=rf"^\[{name}\] {text}$"):
            getattr(engine, name)(ROWS, axis)


@pytest.mark.parametrize("seed", [-1, 2 ** 64])
def test_seeds_are_64_bits(seed):
    for name, make in {"Dense": lambda: engine.Dense(MODEL, "d", 1, 1, seed=seed),
                       "Conv2d": lambda: engine.Conv2d(MODEL, "d", 1, 1, seed=seed),
                       "Embedding": lambda: engine.Embedding(MODEL, "d", 1, 1, seed=seed),
                       "dropout": lambda: engine.dropout(ROWS, 0.5, seed, 0)}.items():
        with pytest.raises(fm.ValueError_, match=rf"^\[{name}\] seed must be {SEED}, got {seed}$"):
            make()
    engine.Dense(engine.Parameters(), "d", 1, 1, seed=2 ** 64 - 1)
