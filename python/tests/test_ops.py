"""Values of ops against numpy's, and gradients against differences."""

import math

import numpy as np
import pytest

import fieldmark as fm
from fieldmark import engine


def random(*shape, seed=0):
    return np.random.default_rng(seed).standard_normal(shape)


def value(f, *arrays):
    tape = engine.Tape("float64")
    return np.array(f(*map(tape.constant, arrays)).numpy())


IMAGES = random(2, 4, 6, 3)
DISTINCT = np.random.default_rng(5).permutation(72).reshape(1, 4, 6, 3) / 9.0  # no two close to each other
ROWS, WEIGHTS = random(4, 3), np.abs(random(4, 3, seed=9))
TRIANGLE = np.tril(random(2, 3, 3)) + 3 * np.eye(3)
GAIN, SHIFT = random(3, seed=1), random(3, seed=2)
LABELS = np.array([2, -1, 0, 1], "int32")


def normalised(x, axes):
    return (x - x.mean(axes, keepdims=True)) / np.sqrt(x.var(axes, keepdims=True) + 1e-5)


def cross_entropy(x, weights):
    counted = LABELS >= 0
    losses = np.log(np.exp(x).sum(-1))[counted] - x[np.arange(4), LABELS][counted]
    return np.average(losses, weights=weights[counted])


def kept(seed, step, stream, shape):
    """What dropout with p = 0.25 keeps, from ones."""
    ones = engine.Tape("float64").constant(np.ones(shape))
    return np.array(engine.dropout(ones, 0.25, seed, step, stream).numpy()) > 0


def unit(x):
    return x / np.linalg.norm(x, axis=-1, keepdims=True)


def convolved(x, w, stride, padding, dilation, groups):
    """A convolution as sums over windows and channels."""
    x = np.pad(x, ((0, 0), (padding, padding), (padding, padding), (0, 0)))
    k, inputs, outputs = w.shape[0], w.shape[2], w.shape[3] // groups
    rows, columns = [(extent - (k - 1) * dilation - 1) // stride + 1 for extent in x.shape[1:3]]
    y = np.zeros((len(x), rows, columns, w.shape[3]))
    for i, j, u, v, o in np.ndindex(rows, columns, k, k, w.shape[3]):
        seen = slice(o // outputs * inputs, (o // outputs + 1) * inputs)
        y[:, i, j, o] += x[:, i * stride + u * dilation, j * stride + v * dilation, seen] @ w[u, v, :, o]
    return y


def spread(x, w, stride, padding):
    """A transposed convolution: each element adds a window of weights."""
    (n, height, width, _), (k, _, outputs, _) = x.shape, w.shape
    y = np.zeros((n, (height - 1) * stride + k, (width - 1) * stride + k, outputs))
    for i, j, u, v in np.ndindex(height, width, k, k):
        y[:, i * stride + u, j * stride + v] += x[:, i, j] @ w[u, v].T
    return y[:, padding:y.shape[1] - padding, padding:y.shape[2] - padding]


CASES = {
    "normal_cdf": (engine.normal_cdf, lambda x: np.vectorize(lambda t: math.erfc(-t / math.sqrt(2)) / 2)(x), [3 * ROWS]),
    "conv2d, stride, padding, dilation and groups": (
        lambda x, w, b: engine.conv2d(x, w, b, stride=2, padding=1, dilation=2, groups=2),
        lambda x, w, b: convolved(x, w, 2, 1, 2, 2) + b,
        [random(1, 5, 6, 4), random(2, 2, 2, 6, seed=6), random(6, seed=7)]),
    "conv_transpose2d": (lambda x, w, b: engine.conv_transpose2d(x, w, b, stride=2, padding=1),
                         lambda x, w, b: spread(x, w, 2, 1) + b,
                         [random(1, 3, 2, 4), random(3, 3, 2, 4, seed=6), random(2, seed=7)]),
    "dropout": (lambda x: engine.dropout(x, 0.25, seed=1, step=2), lambda x: x * kept(1, 2, 0, x.shape) / 0.75, [ROWS]),
    "leaky_relu": (lambda x: engine.leaky_relu(x, 0.1), lambda x: np.where(x > 0, x, 0.1 * x), [ROWS]),
    "elu": (lambda x: engine.elu(x, 2), lambda x: np.where(x > 0, x, 2 * np.expm1(x)), [ROWS]),
    "truncated_exp": (engine.truncated_exp, np.exp, [ROWS]),
    "affine": (lambda x: engine.affine(x, 2, -1), lambda x: 2 * x - 1, [ROWS]),
    "triangular_solve": (engine.triangular_solve, np.linalg.solve, [TRIANGLE, random(2, 3, 2)]),
    "triangular_solve, upper and transposed": (
        lambda a, b: engine.triangular_solve(a, b, upper=True, transposed=True),
        lambda a, b: np.linalg.solve(np.triu(a).transpose(0, 2, 1), b), [TRIANGLE, random(2, 3, 2)]),
    "batch_norm": (engine.batch_norm, lambda x, g, b: g * normalised(x, (0, 1, 2)) + b, [IMAGES, GAIN, SHIFT]),
    "batch_norm_fixed": (
        lambda x, g, b: engine.batch_norm_fixed(x, g, b, np.ones(3), np.full(3, 4.0), eps=1e-12),
        lambda x, g, b: g * (x - 1) / 2 + b, [IMAGES, GAIN, SHIFT]),
    "group_norm": (lambda x, g, b: engine.group_norm(x, g, b, groups=3),
                   lambda x, g, b: g * normalised(x, (1, 2)) + b, [IMAGES, GAIN, SHIFT]),
    "avg_pool": (lambda x: engine.avg_pool(x, 2), lambda x: x.reshape(2, 2, 2, 3, 2, 3).mean((2, 4)), [IMAGES]),
    "max_pool": (lambda x: engine.max_pool(x, 2), lambda x: x.reshape(1, 2, 2, 3, 2, 3).max((2, 4)), [DISTINCT]),
    "upsample_to, nearest": (lambda x: engine.upsample_to(x, 8, 12, mode="nearest"),
                             lambda x: x.repeat(2, 1).repeat(2, 2), [IMAGES]),
    "space_to_depth": (engine.space_to_depth,
                       lambda x: x.reshape(2, 2, 2, 3, 2, 3).transpose(0, 1, 3, 2, 4, 5).reshape(2, 2, 3, 12),
                       [IMAGES]),
    "weighted_mean": (lambda x: engine.weighted_mean(x, WEIGHTS), lambda x: np.average(x, weights=WEIGHTS), [ROWS]),
    "mse_loss": (lambda a, b: engine.mse_loss(a, b, WEIGHTS),
                 lambda a, b: np.average((a - b) ** 2, weights=WEIGHTS), [ROWS, random(4, 3, seed=3)]),
    "l1_loss": (lambda a, b: engine.l1_loss(a, b, weights=WEIGHTS),
                lambda a, b: np.average(np.abs(a - b), weights=WEIGHTS), [ROWS, random(4, 3, seed=3)]),
    "huber_loss": (lambda a, b: engine.huber_loss(a, b, 9.0, WEIGHTS),
                   lambda a, b: np.average((a - b) ** 2 / 2, weights=WEIGHTS), [ROWS, random(4, 3, seed=3)]),
    "bce_with_logits": (lambda x: engine.bce_with_logits(x, WEIGHTS / 4, WEIGHTS),
                        lambda x: np.average(np.log1p(np.exp(x)) - x * WEIGHTS / 4, weights=WEIGHTS), [ROWS]),
    "softmax_cross_entropy": (lambda x: engine.softmax_cross_entropy(x, LABELS, WEIGHTS[:, 0].copy()),
                              lambda x: cross_entropy(x, WEIGHTS[:, 0]), [ROWS]),
    "feature_distance": (lambda a, b: engine.feature_distance(a, b, np.abs(GAIN)),
                         lambda a, b: (np.abs(GAIN) * (unit(a) - unit(b)) ** 2).sum(-1).mean((1, 2)),
                         [np.ascontiguousarray(IMAGES[:1, :2, :2]), random(1, 2, 2, 3, seed=4)]),
}


@pytest.mark.parametrize("name", CASES)
def test_ops_have_numpys_values_and_the_gradients_of_differences(name):
    op, truth, inputs = CASES[name]
    got = value(op, *inputs)
    np.testing.assert_allclose(got.reshape(np.shape(truth(*inputs))), truth(*inputs), rtol=1e-8, atol=1e-10)
    report = engine.gradcheck(op, [x[:1] if x is IMAGES and "batch" not in name
                                   else x for x in inputs])
    assert report.ok, report.table


def test_bilinear_upsampling_keeps_a_slope():
    x = np.arange(4.0).reshape(1, 1, 4, 1)
    y = value(lambda v: engine.upsample_to(v, 1, 8), x).ravel()
    np.testing.assert_allclose(y, [0, 0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3])


def test_reductions_take_axes_as_numpy_does():
    x = random(2, 3, 4)
    for axis in (None, 0, -1, (0, 2), [1], np.int64(1), ()):
        for keepdims in (False, True):
            want = np.sum(x, axis=tuple(axis) if isinstance(axis, list) else axis, keepdims=keepdims)
            got = value(lambda v: engine.sum(v, axis=axis, keepdims=keepdims), x)
            np.testing.assert_allclose(got.reshape(want.shape), want)


def test_dropout_keeps_its_fraction_and_draws_anew_for_each_step_stream_and_seed():
    masks = [kept(*drawn, (100, 100)) for drawn in ((1, 2, 0), (1, 3, 0), (1, 2, 1), (2 ** 64 - 1, 2, 0))]
    for k, mask in enumerate(masks):
        assert abs(mask.mean() - 0.75) < 5 * np.sqrt(0.25 * 0.75 / 1e4)
        assert all(0.3 < (mask != other).mean() < 0.45 for other in masks[:k])  # independent: 2 * 0.25 * 0.75
    np.testing.assert_array_equal(kept(1, 2, 0, (100, 100)), masks[0])
    np.testing.assert_array_equal(value(lambda x: engine.dropout(x, 0, 1, 2), ROWS), ROWS)


def test_new_ops_name_what_does_not_fit():
    tape = engine.Tape("float64")
    x, w, b = (tape.constant(a) for a in (IMAGES, random(3, 3, 3, 4), np.zeros(4)))
    turned = tape.constant(random(3, 3, 4, 3))
    for call, error, text in (
            (lambda: engine.dropout(x, 1, 1, 1), ValueError, r"\[dropout\] p must be .*, got 1"),
            (lambda: engine.dropout(x, 0.5), TypeError, r"\[dropout\] needs seed and step"),
            (lambda: engine.dropout(x, 0.5, 1, 1.5), TypeError, r"\[dropout\] step must be an integer, got float"),
            (lambda: engine.normal_cdf(1.0), TypeError, r"\[normal_cdf\] x must be a value, got float"),
            (lambda: engine.conv2d(x, w, b, dilation=0), ValueError,
             r"\[conv2d\] dilation must be 1 to 2147483647, got 0"),
            (lambda: engine.conv2d(x, w, b, groups=2), ValueError, r"\[conv2d\] groups must divide the channels"),
            (lambda: engine.conv2d(x, w, b, groups="2"), TypeError, r"\[conv2d\] groups must be an integer, got str"),
            (lambda: engine.conv_transpose2d(x, w, b), fm.ShapeError, r"\[conv_transpose2d\] "),
            (lambda: engine.conv_transpose2d(x, turned, b, stride=0), ValueError, r"\[conv_transpose2d\] stride"),
            (lambda: engine.conv_transpose2d(x, w, 3.0), TypeError, r"\[conv_transpose2d\] b must be a value, got")):
        with pytest.raises(error, match="^" + text):
            call()
