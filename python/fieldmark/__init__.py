"""Watermarked radiance fields on a CPU, and the autodiff engine below them.

Arrays are NumPy's, float32 or float64 in row-major order. The engine borrows them, and renders are handed over, both
without copies; images that are read for a mark are copied once. A child of ``os.fork()`` uses one thread.

    import fieldmark as fm
    field = fm.train("lego", seconds=60)
    key = fm.Key.random()
    owner = fm.embed(field, key, bits=16, seconds=120)
    marked = fm.bake(owner, "a5c3")
    images = [marked.render(camera) for camera in marked.cameras(10)]
    owner.verify("a5c3", images)["p_value"]
"""

from __future__ import annotations

import numbers
import operator
import os
from typing import Callable, Optional, Union

from . import _fieldmark, engine
from ._fieldmark import Camera, Error, Field, IoError, Key, Owner, ShapeError, ValueError_, set_threads, threads
from .engine import Adam, Muon, Parameters, Sgd, Tape, gradcheck

Path = Union[str, "os.PathLike[str]"]
Progress = Callable[[int, float], None]

__all__ = [
    "Adam", "Camera", "Error", "Field", "IoError", "Key", "Muon", "Owner", "Parameters", "Sgd", "ShapeError",
    "Tape", "ValueError_", "bake", "embed", "engine", "gradcheck", "set_threads", "threads", "train",
]

if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=lambda: set_threads(1))  # OpenMP's threads are not in the child


def _integer(where: str, given: int, least: int, most: int) -> int:
    """An integer within a range; else TypeError or ValueError."""
    try:
        number = operator.index(given)
    except TypeError:
        raise TypeError(f"[{where} must be an integer, got {type(given).__name__}") from None
    if not least <= number <= most:
        raise ValueError_(f"[{where} must be {least} to {most}, got {number}")
    return number


def _seed(function: str, seed: int) -> int:
    return _integer(f"{function}] seed", seed, 0, 2 ** 64 - 1)


def _instance(where: str, given: object, kind: type) -> None:
    if not isinstance(given, kind):
        raise TypeError(f"[{where} must be {kind.__name__}, got {type(given).__name__}")


def _number(where: str, given: object) -> float:
    if isinstance(given, bool) or not isinstance(given, numbers.Real):
        raise TypeError(f"[{where} must be a number, got {type(given).__name__}")
    return float(given)


def _length(function: str, seconds: Optional[float], steps: Optional[int], default: float) -> tuple[float, int]:
    if seconds is not None and steps is not None:
        raise ValueError_(f"[{function}] give seconds or steps, not both")
    if steps is not None:
        return default, _integer(f"{function}] steps", steps, 1, 2 ** 31 - 1)
    if seconds is None:
        return default, 0
    length = _number(f"{function}] seconds", seconds)
    if not 0 < length < float("inf"):
        raise ValueError_(f"[{function}] seconds must be above 0 and finite, got {seconds}")
    return length, 0


def _progress(function: str, given: object) -> None:
    if given is not None and not callable(given):
        raise TypeError(f"[{function}] progress must be a function, got {type(given).__name__}")


def _path(where: str, given: object) -> str:
    if not isinstance(given, (str, os.PathLike)):
        raise TypeError(f"[{where} must be a path, got {type(given).__name__}")
    return os.fspath(given)


def train(data: Path, *, seconds: Optional[float] = None, steps: Optional[int] = None, size: int = 0,
          seed: int = 0, progress: Optional[Progress] = None) -> Field:
    """Trains a radiance field on a data set.

    Remarks on the data set, such as images left out, are warnings. Error is raised if the training collapses, that is
    if the field shows fog, one colour or nothing.

    :param data: folder of a data set, see ``fieldmark data check``
    :param seconds: length of the training, above 0; 60 by default
    :param steps: length in steps instead, at least 1: equal seeds then give equal fields
    :param size: pixels of the longer side that images are reduced to; 0: as they are
    :param seed: of the initial field and of the rays, 0 to 2^64 - 1
    :param progress: called every 25 steps with the steps taken and the seconds; what it raises ends the training
    """
    length = _length("train", seconds, steps, 60)
    size = _integer("train] size", size, 0, 8192)
    _progress("train", progress)
    return _fieldmark.train(_path("train] data", data), *length, size, _seed("train", seed), progress)


def embed(field: Field, key: Key, *, bits: int = 16, seconds: Optional[float] = None,
          steps: Optional[int] = None, mark_psnr: Optional[float] = None, views: int = 200, seed: int = 0,
          progress: Optional[Progress] = None) -> Owner:
    """Trains a mark and its extractor for a field, whose bytes stay.

    :param field: to mark
    :param key: decides which cells carry which bits; keep it secret
    :param bits: length of messages, 1 to 256
    :param seconds: length of the training, above 0; 300 by default
    :param steps: length in steps instead, at least 1: equal seeds then give equal owners
    :param mark_psnr: of marked to unmarked renders in dB, 20 to 60; higher is fainter; 36.5 by default, and
        up to 40 for objects with flat surfaces
    :param views: cameras that the mark is learnt from, 8 to 10000
    :param seed: of the initial mark, messages, views and distortions, 0 to 2^64 - 1
    :param progress: called every 25 steps with the steps taken and the seconds; what it raises ends the training
    """
    _instance("embed] field", field, Field)
    _instance("embed] key", key, Key)
    length = _length("embed", seconds, steps, 300)
    if mark_psnr is not None:
        mark_psnr = _number("embed] mark_psnr", mark_psnr)
    _progress("embed", progress)
    bits = _integer("embed] bits", bits, 1, 256)
    views = _integer("embed] views", views, 8, 10000)
    return _fieldmark.embed(field, key, bits, *length, mark_psnr, views, _seed("embed", seed), progress)


def bake(owner: Owner, message: str, *, seconds: Optional[float] = None, steps: Optional[int] = None,
         seed: int = 0, progress: Optional[Progress] = None) -> Field:
    """Writes a message into the colours of the owner's field. The result is an ordinary field to publish.

    :param owner: from ``embed``
    :param message: hexadecimal digits, ``ceil(owner.bits / 4)`` of them, most significant bit first
    :param seconds: length of the training, above 0; 45 by default
    :param steps: length in steps instead, at least 1: equal seeds then give equal fields
    :param seed: of cameras and rays, 0 to 2^64 - 1
    :param progress: called every 25 steps with the steps taken and the seconds; what it raises ends the training
    """
    _instance("bake] owner", owner, Owner)
    _instance("bake] message", message, str)
    length = _length("bake", seconds, steps, 45)
    _progress("bake", progress)
    return _fieldmark.bake(owner, message, *length, _seed("bake", seed), progress)
