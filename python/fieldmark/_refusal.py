"""Says why no overload of a function or method takes the given arguments."""

from __future__ import annotations

import operator
import os
import re
from typing import Any, Callable, Mapping, NoReturn, Sequence

import numpy as np

from . import _fieldmark

_SEEDS = ("seed", "step", "stream")
_AXES = ("axis", "order", "a", "b")
_MOST_AXES = 5
_VALUES = (_fieldmark.Value_float32, _fieldmark.Value_float64)


def _is_integer(given: object) -> bool:
    try:
        operator.index(given)  # type: ignore[arg-type]
    except TypeError:
        return False
    return True


def _is_number(given: object) -> bool:
    return isinstance(given, (int, float, np.number)) and not isinstance(given, _VALUES)


def _are_integers(given: object) -> bool:
    return isinstance(given, (list, tuple)) and all(map(_is_integer, given))


def _are_texts(given: object) -> bool:
    return isinstance(given, (list, tuple)) and all(isinstance(text, str) for text in given)


_CHECKS: Mapping[str, tuple[str, Callable[[object], bool]]] = {
    "int": ("an integer", _is_integer),
    "float": ("a number", _is_number),
    "bool": ("True or False", lambda given: isinstance(given, (bool, np.bool_))),
    "str": ("text", lambda given: isinstance(given, str)),
    "bytes": ("bytes", lambda given: isinstance(given, bytes)),
    "os.PathLike": ("a path", lambda given: isinstance(given, (str, bytes, os.PathLike))),
    "Callable": ("a function", callable),
    "function": ("a function", callable),
    "List[int]": ("a sequence of integers", _are_integers),
    "List[str]": ("a sequence of texts", _are_texts),
}


def _arguments(owner: object, name: str) -> list[tuple[str, str, bool]]:
    """Name, type and whether there is a default of each argument, from the text of the first overload."""
    text = re.search(rf"^(?:1\. )?{name}\((.*)\) ->", getattr(owner, name).__doc__, re.MULTILINE)
    assert text is not None
    found = []
    for part in re.split(r", (?=\w+: )", text.group(1)):
        argument, _, rest = part.partition(": ")
        kind, _, default = rest.partition(" = ")
        if argument not in ("", "self"):
            kind = kind.replace("fieldmark._fieldmark.", "").replace("list[", "List[")  # pybind11 2.12
            found.append((argument, kind, bool(default)))
    return found


def _check_values(op: str, given: Sequence[tuple[str, object]]) -> None:
    first = None
    for name, value in given:
        if not isinstance(value, _VALUES):
            hint = ""
            if isinstance(value, np.ndarray):
                hint = ": pass it as tape.constant(x)"
            elif _is_number(value):
                hint = ": pass it as tape.constant(numpy.full((), x, dtype))"
            raise TypeError(f"[{op}] {name} must be a value, got {type(value).__name__}{hint}")
        if first is None:
            first = (name, value.dtype.name)
        elif value.dtype.name != first[1]:
            raise TypeError(f"[{op}] {name} must be a value of {first[1]}, as {first[0]} is, got one of "
                            f"{value.dtype.name}: convert its array with x.astype('{first[1]}')")


def _by_name(op: str, arguments: Sequence[tuple[str, str, bool]], given: Sequence[object],
             named: Mapping[str, object]) -> dict[str, Any]:
    """All given arguments by name; TypeError if one is missing, given twice or not known."""
    names = [name for name, _, _ in arguments]
    if len(given) > len(names):
        raise TypeError(f"[{op}] takes {len(names)} arguments at most, got {len(given)}")
    all_given: dict[str, Any] = dict(zip(names, given))
    for name, value in named.items():
        if name not in names or name in all_given:
            raise TypeError(f"[{op}] got {name} twice" if name in names else f"[{op}] has no argument {name}")
        all_given[name] = value
    missing = [name for name, _, default in arguments if not default and name not in all_given]
    if missing:
        raise TypeError(f"[{op}] needs {' and '.join(missing)}")
    return all_given


def _check_integer(op: str, name: str, value: object) -> None:
    """ValueError if an integer is out of the range of its argument; seeds and axes are known by their names."""
    argument, given = name.partition("[")[0], operator.index(value)  # type: ignore[arg-type]
    low, high = 0, 2 ** 63 - 1
    if argument in _SEEDS:
        high = 2 ** 64 - 1
    elif argument in _AXES:
        low, high = -_MOST_AXES, _MOST_AXES - 1
    if not low <= given <= high:
        error = _fieldmark.ShapeError if argument in _AXES else _fieldmark.ValueError_
        raise error(f"[{op}] {name} must be {low} to {high}, got {given}")


def refuse_axes(op: str, axis: object) -> NoReturn:
    """Raises what a reduction says of axes that are no integers, or too large to be any."""
    if _is_integer(axis):
        _check_integer(op, "axis", axis)
    elif _are_integers(axis):
        for i, one in enumerate(axis):  # type: ignore[arg-type, var-annotated]
            _check_integer(op, f"axis[{i}]", one)
    raise TypeError(f"[{op}] axis must be None, an integer or a sequence of integers, got {axis!r}")


def _check_kind(op: str, name: str, kind: str, value: object) -> None:
    """TypeError if a value is not of the kind that the text of a function names."""
    optional = re.fullmatch(r"Optional\[(.*)\]", kind)
    if optional and value is None:
        return
    kind = optional.group(1) if optional else kind
    if kind in _CHECKS and not _CHECKS[kind][1](value):
        raise TypeError(f"[{op}] {name} must be {_CHECKS[kind][0]}, got {type(value).__name__}")
    if kind == "int":
        _check_integer(op, name, value)
    elif kind == "List[int]":
        for i, one in enumerate(value):  # type: ignore[arg-type]
            _check_integer(op, f"{name}[{i}]", one)
    each = re.fullmatch(r"List\[(\w+)\]", kind)
    owner = getattr(_fieldmark, each.group(1), None) if each else None
    if each and isinstance(owner, type):
        if not isinstance(value, (list, tuple)):
            raise TypeError(f"[{op}] {name} must be a sequence of {each.group(1)}(), got {type(value).__name__}")
        for i, one in enumerate(value):
            if not isinstance(one, owner):
                raise TypeError(f"[{op}] {name} must be a sequence of {each.group(1)}(), got one of "
                                f"{type(one).__name__} at {i}")
    owner = getattr(_fieldmark, kind, None)
    if isinstance(owner, type) and not isinstance(value, owner):
        plain, _, scalar = kind.partition("_")
        of = f" of {scalar}" if scalar else ""
        raise TypeError(f"[{op}] {name} must be {plain}(){of}, got {type(value).__name__}")


def refuse(op: str, given: Sequence[object], named: Mapping[str, object]) -> NoReturn:
    """Raises TypeError that names the argument of a function which does not fit."""
    arguments = _arguments(_fieldmark, op)
    all_given = _by_name(op, arguments, given, named)
    values: list[tuple[str, object]] = []
    for name, kind, _ in arguments:
        if kind == "Value_float32":
            values.append((name, all_given[name]))
        elif kind == "List[Value_float32]":
            if not isinstance(all_given[name], (list, tuple)):
                raise TypeError(f"[{op}] {name} must be a list of values, got {type(all_given[name]).__name__}")
            values += [(f"{name}[{i}]", value) for i, value in enumerate(all_given[name])]
    _check_values(op, values)
    for name, kind, _ in arguments:
        if name not in all_given or kind.startswith(("Value", "List[Value")):
            continue
        value = all_given[name]
        if not kind.startswith("Parameters"):
            _check_kind(op, name, kind, value)
        elif not type(value).__name__.startswith("Parameters"):
            raise TypeError(f"[{op}] {name} must be Parameters(), got {type(value).__name__}")
    _refuse_together(op, arguments, all_given)


def refuse_method(op: str, owner: str, method: str, given: Sequence[object],
                  named: Mapping[str, object]) -> NoReturn:
    """Raises TypeError that names the argument of a method or constructor which does not fit."""
    arguments = _arguments(getattr(_fieldmark, owner), method)
    all_given = _by_name(op, arguments, given, named)
    for name, kind, _ in arguments:
        if name in all_given:
            _check_kind(op, name, kind, all_given[name])
    _refuse_together(op, arguments, all_given)


def _refuse_together(op: str, arguments: Sequence[tuple[str, str, bool]], given: Mapping[str, object]) -> NoReturn:
    raise TypeError(f"[{op}] takes {', '.join(name for name, _, _ in arguments) or 'no arguments'}, got "
                    + ", ".join(f"{name}={value}" if _is_number(value) else f"{name} of {type(value).__name__}"
                                for name, value in given.items()))
