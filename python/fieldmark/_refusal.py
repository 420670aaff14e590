"""Says why no overload of an op takes the given arguments."""

from __future__ import annotations

import operator
import re
from typing import Any, Callable, Mapping, NoReturn, Sequence

import numpy as np

from . import _fieldmark

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


_CHECKS: Mapping[str, tuple[str, Callable[[object], bool]]] = {
    "int": ("an integer", _is_integer),
    "float": ("a number", _is_number),
    "bool": ("True or False", lambda given: isinstance(given, (bool, np.bool_))),
    "str": ("text", lambda given: isinstance(given, str)),
    "List[int]": ("a sequence of integers", _are_integers),
}


def _arguments(op: str) -> list[tuple[str, str, bool]]:
    """Name, type and whether there is a default of each argument, from the text of the first overload."""
    text = re.search(rf"^1\. {op}\((.*)\) ->", getattr(_fieldmark, op).__doc__, re.MULTILINE)
    assert text is not None
    found = []
    for part in re.split(r", (?=\w+: )", text.group(1)):
        name, rest = part.split(": ", 1)
        kind, _, default = rest.partition(" = ")
        found.append((name, kind.replace("fieldmark._fieldmark.", ""), bool(default)))
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


def refuse(op: str, given: Sequence[object], named: Mapping[str, object]) -> NoReturn:
    """Raises TypeError that names the argument which does not fit."""
    arguments = _arguments(op)
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
        if name not in all_given:
            continue
        value = all_given[name]
        if kind in _CHECKS and not _CHECKS[kind][1](value):
            raise TypeError(f"[{op}] {name} must be {_CHECKS[kind][0]}, got {type(value).__name__}")
        if kind.startswith("Parameters") and not type(value).__name__.startswith("Parameters"):
            raise TypeError(f"[{op}] {name} must be Parameters(), got {type(value).__name__}")
        if kind == "SafetensorsFile" and not isinstance(value, _fieldmark.SafetensorsFile):
            raise TypeError(f"[{op}] {name} must be SafetensorsFile(), got {type(value).__name__}")
    raise TypeError(f"[{op}] takes {', '.join(names)}, got "
                    + ", ".join(f"{name} of {type(value).__name__}" for name, value in all_given.items()))
