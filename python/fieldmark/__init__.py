"""Watermarked radiance fields on a CPU, and the autodiff engine below them.

Arrays are numpy's, float32 or float64 in row-major order. The engine borrows them, and renders are handed over, both
without copies; images that are read for a mark are copied once.

    import fieldmark as fm
    field = fm.train("lego", seconds=60)
    key = fm.Key.random()
    owner = fm.embed(field, key, bits=16, seconds=120)
    marked = fm.bake(owner, "a5c3")
    images = [marked.render(camera) for camera in marked.cameras(10)]
    owner.verify("a5c3", images)["p_value"]
"""

from __future__ import annotations

import os
from typing import Callable, Optional, Union

from . import _fieldmark, engine
from ._fieldmark import Camera, Error, Field, IoError, Key, Owner, ShapeError, set_threads, threads
from .engine import Adam, Muon, Parameters, Sgd, Tape, gradcheck

Path = Union[str, "os.PathLike[str]"]
Progress = Callable[[int, float], None]

__all__ = [
    "Adam", "Camera", "Error", "Field", "IoError", "Key", "Muon", "Owner", "Parameters", "Sgd", "ShapeError",
    "Tape", "bake", "embed", "engine", "gradcheck", "set_threads", "threads", "train",
]


def _length(seconds: Optional[float], steps: Optional[int], default: float) -> tuple[float, int]:
    if seconds is not None and steps is not None:
        raise ValueError("[length] give seconds or steps, not both")
    if steps is not None and steps < 1:
        raise ValueError(f"[length] steps must be at least 1, got {steps}")
    if seconds is not None and not 0 < seconds < float("inf"):
        raise ValueError(f"[length] seconds must be above 0 and finite, got {seconds}")
    return (default if seconds is None else seconds, steps or 0)


def train(data: Path, *, seconds: Optional[float] = None, steps: Optional[int] = None, size: int = 0,
          seed: int = 0, progress: Optional[Progress] = None) -> Field:
    """Trains a radiance field on a data set.

    :param data: folder of a data set, see ``fieldmark data check``
    :param seconds: length of the training; 60 by default
    :param steps: length in steps instead: equal seeds then give equal fields
    :param size: pixels of the longer side that images are reduced to; 0: as they are
    :param progress: called now and then with the steps taken and the seconds
    """
    length = _length(seconds, steps, 60)
    return _fieldmark.train(os.fspath(data), *length, size, seed, progress)


def embed(field: Field, key: Key, *, bits: int = 16, seconds: Optional[float] = None,
          steps: Optional[int] = None, mark_psnr: Optional[float] = None, views: int = 200, seed: int = 0,
          progress: Optional[Progress] = None) -> Owner:
    """Trains a mark and its extractor for a field.

    :param bits: length of messages, 1 to 256
    :param seconds: length of the training; 300 by default
    :param mark_psnr: of marked to unmarked renders in dB, 20 to 60; higher is fainter; 36.5 by default, and
        up to 40 for objects with flat surfaces
    :param views: cameras that the mark is learnt from
    """
    length = _length(seconds, steps, 300)
    return _fieldmark.embed(field, key, bits, *length, mark_psnr, views, seed, progress)


def bake(owner: Owner, message: str, *, seconds: Optional[float] = None, steps: Optional[int] = None,
         seed: int = 0, progress: Optional[Progress] = None) -> Field:
    """Writes a message into the colours of a field, which is then an ordinary field to publish.

    :param message: hexadecimal digits, most significant bit first
    :param seconds: length of the training; 45 by default
    """
    length = _length(seconds, steps, 45)
    return _fieldmark.bake(owner, message, *length, seed, progress)
