"""Reverse-mode automatic differentiation on numpy arrays.

    tape = Tape()
    x = tape.leaf(numpy.ones(3, "float32"))
    loss = engine.sum(x * x)
    loss.backward()
    x.grad

A value holds until ``tape.reset()``. Arrays that ``numpy()`` and ``grad`` give show the tape's own memory;
the next ``backward()`` overwrites those of ``grad``, and while one of them lives, the tape refuses to be reset. Arrays
that a tape reads are read-only until then.
"""

from __future__ import annotations

from typing import Any, Callable, List, Literal, Optional, Sequence, Tuple, Type, TypeVar, Union, overload

import numpy as np
import numpy.typing as npt

from . import _fieldmark
from ._fieldmark import (
    AdamGroup, Adam_float32, Adam_float64, BatchNorm_float32, BatchNorm_float64, BatchStatistics, Conv2d_float32,
    Conv2d_float64, Dense_float32, Dense_float64, Embedding_float32, Embedding_float64, GradcheckReport,
    GroupNorm_float32, GroupNorm_float64, Inspector_float32, Inspector_float64, LayerNorm_float32,
    LayerNorm_float64, Muon_float32, Muon_float64, OpCost, Parameters_float32, Parameters_float64, SafetensorsFile,
    Schedule, Sgd_float32, Sgd_float64, Tape_float32, Tape_float64, Value_float32, Value_float64, abs, affine,
    avg_pool, batch_norm, batch_norm_fixed, bce_with_logits, broadcast_to, cholesky, clamp, concatenate, conv2d,
    conv_transpose2d, cos, cosine_decay, cumsum, dense, detach, determinant, dropout, elu, equal, exp, expm1,
    exponential_decay, feature_distance, gather, gelu, global_avg_pool, greater, group_norm, huber_loss, inverse,
    l1_loss, layer_norm, leaky_relu, less, load_state, log, log1p, log_determinant, logsumexp, matmul, max,
    max_pool, maximum, mean, minimum, mse_loss, negate, normal_cdf, pad, permute, reciprocal, relu, reshape,
    save_state, scatter_add, sigmoid, silu, sin, slice, softmax, softmax_cross_entropy, softplus, solve,
    space_to_depth, sqrt, square, step_decay, sum, symmetric_eigenvalues, tanh, transpose, triangular_solve,
    truncated_exp, upsample_nearest, upsample_to, variance, warm_up, weighted_mean, where)

__all__ = [
    "Adam", "AdamGroup", "Adam_float32", "Adam_float64", "BatchNorm", "BatchNorm_float32", "BatchNorm_float64",
    "BatchStatistics", "Conv2d", "Conv2d_float32", "Conv2d_float64", "Dense", "Dense_float32", "Dense_float64",
    "Embedding", "Embedding_float32", "Embedding_float64", "GradcheckReport", "GroupNorm", "GroupNorm_float32",
    "GroupNorm_float64", "Inspector", "Inspector_float32", "Inspector_float64", "LayerNorm", "LayerNorm_float32",
    "LayerNorm_float64", "Muon", "Muon_float32", "Muon_float64", "OpCost", "Parameters", "Parameters_float32",
    "Parameters_float64", "SafetensorsFile", "Schedule", "Sgd", "Sgd_float32", "Sgd_float64", "Tape",
    "Tape_float32", "Tape_float64", "Value", "Value_float32", "Value_float64", "abs", "affine", "avg_pool",
    "batch_norm", "batch_norm_fixed", "bce_with_logits", "broadcast_to", "cholesky", "clamp", "concatenate",
    "conv2d", "conv_transpose2d", "cos", "cosine_decay", "cumsum", "dense", "detach", "determinant", "dropout",
    "elu", "equal", "exp", "expm1", "exponential_decay", "feature_distance", "gather", "gelu", "global_avg_pool",
    "gradcheck", "greater", "group_norm", "huber_loss", "hvp", "inverse", "jvp", "l1_loss", "layer_norm",
    "leaky_relu", "less", "load_state", "log", "log1p", "log_determinant", "logsumexp", "matmul", "max", "max_pool",
    "maximum", "mean", "minimum", "mse_loss", "negate", "normal_cdf", "pad", "permute", "reciprocal", "relu",
    "reshape", "save_state", "scatter_add", "sigmoid", "silu", "sin", "slice", "softmax", "softmax_cross_entropy",
    "softplus", "solve", "space_to_depth", "sqrt", "square", "step_decay", "sum", "symmetric_eigenvalues", "tanh",
    "transpose", "triangular_solve", "truncated_exp", "upsample_nearest", "upsample_to", "variance", "vjp",
    "warm_up", "weighted_mean", "where",
]

Value = Union[Value_float32, Value_float64]
F = TypeVar("F", np.float32, np.float64)
Float32 = Union[Literal["float32"], Type[np.float32]]
Float64 = Union[Literal["float64"], Type[np.float64]]


def _of(name: str, dtype: object) -> Any:
    kind = np.dtype(dtype).name  # type: ignore[call-overload]
    if kind not in ("float32", "float64"):
        raise TypeError(f"[{name}] dtype must be float32 or float64, got {kind}")
    return getattr(_fieldmark, f"{name}_{kind}")


def _like(name: str, what: str, given: object) -> Any:
    """The class for the scalar type of what it is made for: a tape or parameters."""
    for kind in ("float32", "float64"):
        if isinstance(given, getattr(_fieldmark, f"{what}_{kind}")):
            return getattr(_fieldmark, f"{name}_{kind}")
    raise TypeError(f"[{name}] {what.lower()} must be {what}(), got {type(given).__name__}")


@overload
def Tape(dtype: Float32 = "float32") -> Tape_float32: ...  # type: ignore[misc]
@overload
def Tape(dtype: Float64) -> Tape_float64: ...
def Tape(dtype: object = "float32") -> Any:
    """A tape that records operations on arrays of one type."""
    return _of("Tape", dtype)()


@overload
def Parameters(dtype: Float32 = "float32") -> Parameters_float32: ...  # type: ignore[misc]
@overload
def Parameters(dtype: Float64) -> Parameters_float64: ...
def Parameters(dtype: object = "float32") -> Any:
    """All parameters of a model in one buffer, with their gradients in another."""
    return _of("Parameters", dtype)()


@overload
def Adam(parameters: Parameters_float32, *, lr: float = ..., beta1: float = ..., beta2: float = ...,
         eps: float = ..., weight_decay: float = ..., skip_zero: bool = ...,
         groups: Optional[Sequence[AdamGroup]] = ...) -> Adam_float32: ...
@overload
def Adam(parameters: Parameters_float64, *, lr: float = ..., beta1: float = ..., beta2: float = ...,
         eps: float = ..., weight_decay: float = ..., skip_zero: bool = ...,
         groups: Optional[Sequence[AdamGroup]] = ...) -> Adam_float64: ...
def Adam(parameters: Any, *, lr: float = 1e-3, beta1: float = 0.9, beta2: float = 0.999, eps: float = 1e-8,
         weight_decay: float = 0.0, skip_zero: bool = False, groups: Optional[Sequence[AdamGroup]] = None) -> Any:
    """Adam (Kingma and Ba 2015); its weight decay is decoupled, as AdamW's (Loshchilov and Hutter 2019).

        engine.Adam(model, groups=[engine.AdamGroup("*bias", lr_factor=2), engine.AdamGroup("*", weight_decay=0.01)])

    :param skip_zero: leaves entries with a gradient of exactly 0, and their moments, as they are; for tables
    :param groups: each tensor has the settings of the first group that matches its name; no step changes a tensor of
        no group. ValueError if a group matches nothing, or beside ``weight_decay`` or ``skip_zero``, which each
        group has of its own
    """
    return _like("Adam", "Parameters", parameters)(parameters, lr, beta1, beta2, eps, weight_decay, skip_zero,
                                                   None if groups is None else list(groups))


@overload
def Sgd(parameters: Parameters_float32, *, lr: float = ..., momentum: float = ..., nesterov: bool = ...,
        weight_decay: float = ...) -> Sgd_float32: ...
@overload
def Sgd(parameters: Parameters_float64, *, lr: float = ..., momentum: float = ..., nesterov: bool = ...,
        weight_decay: float = ...) -> Sgd_float64: ...
def Sgd(parameters: Any, *, lr: float = 1e-2, momentum: float = 0.0, nesterov: bool = False,
        weight_decay: float = 0.0) -> Any:
    """Stochastic gradient descent with momentum."""
    return _like("Sgd", "Parameters", parameters)(parameters, lr, momentum, nesterov, weight_decay)


@overload
def Muon(parameters: Parameters_float32, names: Sequence[str], *, lr: float = ...,
         momentum: float = ...) -> Muon_float32: ...
@overload
def Muon(parameters: Parameters_float64, names: Sequence[str], *, lr: float = ...,
         momentum: float = ...) -> Muon_float64: ...
def Muon(parameters: Any, names: Sequence[str], *, lr: float = 1e-3, momentum: float = 0.95) -> Any:
    """Muon on the tensors of two axes or more whose names match a pattern, as in ``["*/weight"]``.

    A step sets their gradients to 0. An ``Adam`` without weight decay that steps after it then changes the other
    tensors alone. Leave out a last layer of classes.
    """
    if isinstance(names, str):
        raise TypeError("[Muon] names must be a list of patterns, got str")
    return _like("Muon", "Parameters", parameters)(parameters, list(names), lr, momentum)


@overload
def Dense(parameters: Parameters_float32, name: str, inputs: int, outputs: int, *, seed: int, relu: bool = ...,
          bias: bool = ...) -> Dense_float32: ...
@overload
def Dense(parameters: Parameters_float64, name: str, inputs: int, outputs: int, *, seed: int, relu: bool = ...,
          bias: bool = ...) -> Dense_float64: ...
def Dense(parameters: Any, name: str, inputs: int, outputs: int, *, seed: int, relu: bool = False,
          bias: bool = True) -> Any:
    """An affine layer: ``layer(x)`` is x W + b of rows x [N, inputs], with ``relu`` max(x W + b, 0).

    Its parameters are NAME/weight [inputs, outputs], uniform in +-sqrt(6 / inputs) at first (He et al. 2015), and
    NAME/bias [outputs], 0 at first; without ``bias``, b is 0 and no parameter.
    """
    return _like("Dense", "Parameters", parameters)(parameters, name, inputs, outputs, relu, seed, bias)


@overload
def Conv2d(parameters: Parameters_float32, name: str, inputs: int, outputs: int, *, seed: int, kernel: int = ...,
           relu: bool = ..., stride: int = ..., padding: Optional[int] = ..., bias: bool = ...) -> Conv2d_float32: ...
@overload
def Conv2d(parameters: Parameters_float64, name: str, inputs: int, outputs: int, *, seed: int, kernel: int = ...,
           relu: bool = ..., stride: int = ..., padding: Optional[int] = ..., bias: bool = ...) -> Conv2d_float64: ...
def Conv2d(parameters: Any, name: str, inputs: int, outputs: int, *, seed: int, kernel: int = 3, relu: bool = False,
           stride: int = 1, padding: Optional[int] = None, bias: bool = True) -> Any:
    """A convolution of images [N, H, W, inputs], which keeps their size by default: ``layer(x)``.

    Its parameters are NAME/weight [kernel, kernel, inputs, outputs], uniform in +-sqrt(6 / (kernel^2 inputs)) at
    first (He et al. 2015), and NAME/bias [outputs], 0 at first; without ``bias``, b is 0 and no parameter.

    :param kernel: side of the window, odd unless ``padding`` is given
    :param stride: pixels from one window to the next, at least 1
    :param padding: pixels of zeros around the image, at least 0; by default (kernel - 1) / 2
    """
    return _like("Conv2d", "Parameters", parameters)(parameters, name, inputs, outputs, kernel, relu, seed, stride,
                                                     padding, bias)


@overload
def Embedding(parameters: Parameters_float32, name: str, count: int, width: int, *, seed: int) -> Embedding_float32: ...
@overload
def Embedding(parameters: Parameters_float64, name: str, count: int, width: int, *, seed: int) -> Embedding_float64: ...
def Embedding(parameters: Any, name: str, count: int, width: int, *, seed: int) -> Any:
    """A learnt vector for each of ``count`` items: ``layer(tape, index)`` is rows [N, width], index [N] of int32.

    Its parameter is NAME/table [count, width], standard normal at first. ValueError if an index is outside
    [0, count).
    """
    return _like("Embedding", "Parameters", parameters)(parameters, name, count, width, seed)


@overload
def BatchNorm(parameters: Parameters_float32, name: str, channels: int, *, eps: float = ...,
              relu: bool = ...) -> BatchNorm_float32: ...
@overload
def BatchNorm(parameters: Parameters_float64, name: str, channels: int, *, eps: float = ...,
              relu: bool = ...) -> BatchNorm_float64: ...
def BatchNorm(parameters: Any, name: str, channels: int, *, eps: float = 1e-5, relu: bool = False) -> Any:
    """Batch normalisation of images [N, H, W, channels].

        statistics = engine.BatchStatistics()
        y = layer(x, statistics)      # with the statistics of the batch
        layer.update(statistics)      # running averages
        y = layer.evaluate(x)         # with the running averages

    Its parameters are NAME/gamma, NAME/beta, and the running NAME/running_mean and NAME/running_variance.
    """
    return _like("BatchNorm", "Parameters", parameters)(parameters, name, channels, eps, relu)


@overload
def GroupNorm(parameters: Parameters_float32, name: str, channels: int, *, groups: int = ..., eps: float = ...,
              relu: bool = ...) -> GroupNorm_float32: ...
@overload
def GroupNorm(parameters: Parameters_float64, name: str, channels: int, *, groups: int = ..., eps: float = ...,
              relu: bool = ...) -> GroupNorm_float64: ...
def GroupNorm(parameters: Any, name: str, channels: int, *, groups: int = 8, eps: float = 1e-5,
              relu: bool = False) -> Any:
    """Group normalisation of images [N, H, W, channels]: ``layer(x)``. Its parameters are NAME/gamma and NAME/beta."""
    return _like("GroupNorm", "Parameters", parameters)(parameters, name, channels, groups, eps, relu)


@overload
def LayerNorm(parameters: Parameters_float32, name: str, channels: int, *, eps: float = ...) -> LayerNorm_float32: ...
@overload
def LayerNorm(parameters: Parameters_float64, name: str, channels: int, *, eps: float = ...) -> LayerNorm_float64: ...
def LayerNorm(parameters: Any, name: str, channels: int, *, eps: float = 1e-5) -> Any:
    """Layer normalisation of rows [.., channels]: ``layer(x)``. Its parameters are NAME/gamma and NAME/beta."""
    return _like("LayerNorm", "Parameters", parameters)(parameters, name, channels, eps)


@overload
def Inspector(tape: Tape_float32, *, stop_at_nonfinite: bool = ..., statistics: bool = ...) -> Inspector_float32: ...
@overload
def Inspector(tape: Tape_float64, *, stop_at_nonfinite: bool = ..., statistics: bool = ...) -> Inspector_float64: ...
def Inspector(tape: Any, *, stop_at_nonfinite: bool = False, statistics: bool = False) -> Any:
    """Looks at what a tape records, until ``close()`` or the end of a ``with`` block.

        with engine.Inspector(tape, stop_at_nonfinite=True) as inspector:
            ...
            print(inspector.cost_table())

    :param stop_at_nonfinite: raises ValueError where the first NaN or infinity arises, forward or backward
    :param statistics: gathers ``value_stats()`` and ``gradient_stats()``, which read all elements
    """
    return _like("Inspector", "Tape", tape)(tape, stop_at_nonfinite, statistics)


def gradcheck(f: Callable[..., Value_float64], inputs: Sequence[npt.NDArray[np.float64]],
              rtol: float = 1e-7, parameters: Optional[Parameters_float64] = None) -> GradcheckReport:
    """Compares gradients with finite differences, in float64. The report is true if no gradient is wrong.

    Parameters that layers of f read, but which are not in ``parameters``, are constants of the check. It still adds
    to their gradients: call ``zero_grad()`` before you train on.

    :param f: takes a value for each input and returns one
    :param inputs: arrays of float64
    :param rtol: largest relative error of a gradient, see ``GradcheckReport.worst``
    :param parameters: their gradients are checked, too; f reads them through layers or ``leaf(x.tape, name)``
    """
    return _fieldmark.gradcheck(f, list(inputs), rtol, parameters)


def vjp(f: Callable[..., Any], inputs: Sequence[npt.NDArray[F]],
        cotangent: npt.NDArray[F]) -> Tuple[npt.NDArray[F], List[npt.NDArray[F]]]:
    """The value f(x), and the vector-Jacobian product J^T u for each input, in reverse mode.

        value, (by_a, by_b) = engine.vjp(lambda a, b: a @ b, [a, b], np.ones((3, 2)))

    An input that f does not use gives zeros. ShapeError unless u has the shape of f(x). As every backward, it adds to
    the gradients of parameters that layers of f read: call ``zero_grad()`` before you train on.

    :param f: takes a value for each input and returns one
    :param inputs: arrays, all float32 or all float64
    :param cotangent: u, of the shape and type of f(x)
    """
    return _fieldmark.vjp(f, list(inputs), cotangent)


def jvp(f: Callable[..., Any], inputs: Sequence[npt.NDArray[F]],
        tangents: Sequence[npt.NDArray[F]]) -> Tuple[npt.NDArray[F], npt.NDArray[F]]:
    """The value f(x), and the Jacobian-vector product J v = d/ds f(x + s v) at s = 0, in forward mode.

    TypeError if f uses an op without a tangent: ``max_pool``, ``conv_transpose2d``, ``dropout``,
    ``symmetric_eigenvalues`` and layers. ShapeError or ValueError if the tangents do not fit the inputs.

    :param f: takes a value for each input and returns one
    :param inputs: arrays, all float32 or all float64
    :param tangents: v, one array per input, of its shape and type
    """
    return _fieldmark.jvp(f, list(inputs), list(tangents))


def hvp(f: Callable[..., Any], inputs: Sequence[npt.NDArray[F]],
        directions: Sequence[npt.NDArray[F]]) -> Tuple[npt.NDArray[F], List[npt.NDArray[F]]]:
    """The value f(x) of one element, and the Hessian-vector product H v for each input.

    Errors as of ``jvp``, and ShapeError if f(x) has more than one element. Adds to the gradients of parameters that f
    reads with ``leaf``, as ``vjp`` does.

    :param f: takes a value for each input and returns one of one element
    :param inputs: arrays, all float32 or all float64
    :param directions: v, one array per input, of its shape and type
    """
    return _fieldmark.hvp(f, list(inputs), list(directions))
