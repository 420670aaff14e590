"""Reverse-mode automatic differentiation on numpy arrays.

    tape = Tape()
    x = tape.leaf(numpy.ones(3, "float32"))
    loss = engine.sum(x * x)
    loss.backward()
    x.grad

A value holds until ``tape.reset()``. Arrays that ``numpy()`` and ``grad`` give show the tape's own memory;
while one of them lives, the tape refuses to be reset.
"""

from __future__ import annotations

from typing import Callable, Sequence, Union

import numpy as np

from . import _fieldmark
from ._fieldmark import (  # noqa: F401
    GradcheckReport, abs, broadcast_to, cholesky, clamp, concatenate, conv2d, cos, cumsum, dense, detach,
    determinant, equal, exp, expm1, gather, gelu, global_avg_pool, greater, huber_loss, inverse, l1_loss,
    layer_norm, less, log, log1p, log_determinant, logsumexp, matmul, max, max_pool, maximum, mean, minimum,
    mse_loss, negate, pad, permute, reciprocal, relu, reshape, scatter_add, sigmoid, silu, sin, slice, softmax,
    softmax_cross_entropy, softplus, solve, sqrt, square, sum, symmetric_eigenvalues, tanh, transpose,
    upsample_nearest, variance, where)

Value = Union[_fieldmark.Value_float32, _fieldmark.Value_float64]


def _of(name: str, dtype: object):
    kind = np.dtype(dtype).name
    if kind not in ("float32", "float64"):
        raise TypeError(f"[{name}] dtype must be float32 or float64, got {kind}")
    return getattr(_fieldmark, f"{name}_{kind}")


def Tape(dtype: object = "float32") -> Union[_fieldmark.Tape_float32, _fieldmark.Tape_float64]:
    """A tape that records operations on arrays of one type."""
    return _of("Tape", dtype)()


def Parameters(dtype: object = "float32") -> Union[_fieldmark.Parameters_float32, _fieldmark.Parameters_float64]:
    """All parameters of a model in one buffer, with their gradients in another."""
    return _of("Parameters", dtype)()


def _optimiser(name: str, parameters, options):
    kind = "float64" if isinstance(parameters, _fieldmark.Parameters_float64) else "float32"
    return getattr(_fieldmark, f"{name}_{kind}")(parameters, **options)


def Adam(parameters, *, lr: float = 1e-3, beta1: float = 0.9, beta2: float = 0.999, eps: float = 1e-8,
         weight_decay: float = 0.0):
    """Adam (Kingma and Ba 2015); its weight decay is decoupled, as AdamW's (Loshchilov and Hutter 2019)."""
    return _optimiser("Adam", parameters,
                      {"lr": lr, "beta1": beta1, "beta2": beta2, "eps": eps, "weight_decay": weight_decay})


def Sgd(parameters, *, lr: float = 1e-2, momentum: float = 0.0, nesterov: bool = False, weight_decay: float = 0.0):
    """Stochastic gradient descent with momentum."""
    return _optimiser("Sgd", parameters,
                      {"lr": lr, "momentum": momentum, "nesterov": nesterov, "weight_decay": weight_decay})


def gradcheck(f: Callable[..., Value], inputs: Sequence[np.ndarray], rtol: float = 1e-7) -> GradcheckReport:
    """Compares gradients with finite differences, in float64.

    :param f: takes a value for each input and returns one
    :param inputs: arrays of float64
    """
    return _fieldmark.gradcheck(f, list(inputs), rtol)
