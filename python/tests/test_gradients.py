"""Products with Jacobians."""

import numpy as np
import pytest

import fieldmark as fm
from fieldmark import engine
from test_ops import CASES


def random(*shape, dtype="float64", seed=0):
    return np.random.default_rng(seed).standard_normal(shape).astype(dtype)


@pytest.mark.parametrize("dtype, rtol", [("float32", 1e-5), ("float64", 1e-12)])
def test_a_vector_jacobian_product_is_that_of_the_formula(dtype, rtol):
    a, b, u = random(3, 4, dtype=dtype), random(4, 2, dtype=dtype, seed=1), random(3, 2, dtype=dtype, seed=2)
    value, products = engine.vjp(lambda x, y: engine.tanh(x @ y), [a, b], u)
    slope = u * (1 - np.tanh(a @ b) ** 2)
    assert value.dtype == dtype and all(p.dtype == dtype for p in products)
    for got, want in zip([value, *products], [np.tanh(a @ b), slope @ b.T, a.T @ slope]):
        np.testing.assert_allclose(got, want, rtol=rtol, atol=rtol)


def test_an_input_that_is_not_used_gives_zeros_and_inputs_stay_writeable():
    a, b = random(3), random(2)
    value, (by_a, by_b) = engine.vjp(lambda x, y: x * 2, [a, b], np.ones(3))
    np.testing.assert_array_equal(by_a, [2, 2, 2])
    np.testing.assert_array_equal(by_b, [0, 0])
    a[:] = by_a[:] = value[:] = 0


def test_layers_take_part_in_products():
    model = engine.Parameters("float64")
    layer = engine.Dense(model, "d", 3, 2, seed=1)
    _, (product,) = engine.vjp(layer, [random(4, 3)], np.ones((4, 2)))
    np.testing.assert_allclose(product, np.ones((4, 2)) @ model.values("d/weight").T)


WITHOUT_TANGENT = {"max_pool", "conv_transpose2d", "dropout"}
MORE = {  # what test_ops.py leaves to numpy's operators
    "operators": (lambda a, b: (2 - a) * b / (1 + a * a) - (-a) ** 2 + 3 / (b * b + 1),
                  [random(2, 3), random(3, seed=1)]),
    "powers": (lambda a, b: a ** b, [np.abs(random(3)) + 0.5, random(3, seed=1)]),
    "matmul": (lambda a, b: engine.matmul(a, b) + a @ b, [random(2, 3, 4), random(4, 2, seed=1)]),
    "solve": (engine.solve, [random(3, 3) + 4 * np.eye(3), random(3, 2, seed=1)]),
    "inverse": (engine.inverse, [random(3, 3) + 4 * np.eye(3)]),
    "dense": (lambda x, w, b: engine.dense(x, w, b, relu=True),
              [random(4, 3), random(3, 2, seed=1), random(2, seed=2)]),
    "layer_norm": (engine.layer_norm, [random(4, 3), random(3, seed=1), random(3, seed=2)]),
    "softmax": (lambda x: engine.softmax(x, 0), [random(4, 3)]),
    "reductions": (lambda x: engine.sum(x, 0) * engine.mean(x) + engine.variance(x, 0) * engine.max(x, 0)
                   + engine.logsumexp(x, 0), [random(4, 3)]),
    "layout": (lambda x: engine.cumsum(engine.pad(engine.permute(engine.reshape(x, (2, 6)), (1, 0)), 0, 1, 2)),
               [random(4, 3)]),
    "parts": (lambda x, y: engine.concatenate([engine.slice(x, 0, 1, 2), engine.transpose(y)], 0)
              * engine.broadcast_to(engine.slice(x, 0, 0, 1), (4, 3)), [random(4, 3), random(3, 2, seed=1)]),
    "one of two moves": (lambda x: engine.concatenate([engine.detach(x), engine.square(x)], 0), [random(4, 3)]),
    "indexing": (lambda x: engine.scatter_add(engine.gather(x, 0, np.array([2, 0, 2], "int32")), 0,
                                              np.array([1, 1, 0], "int32"), 2), [random(4, 3)]),
    "choices": (lambda a, b: engine.where(a > b, engine.clamp(a, -1, 1), engine.minimum(a * 2, b))
                + engine.less(a, b), [random(4, 3), random(4, 3, seed=1)]),
    "images": (lambda x: engine.upsample_nearest(engine.global_avg_pool(x) + 0 * engine.avg_pool(x, 2), 2),
               [random(1, 2, 2, 3)]),
}
MAPS = ["relu", "sigmoid", "tanh", "exp", "truncated_exp", "softplus", "silu", "gelu", "normal_cdf", "negate",
        "reciprocal", "abs", "square", "sqrt", "log", "log1p", "expm1", "sin", "cos", "cholesky", "determinant",
        "log_determinant"]
POSITIVE = np.eye(3) * 3 + np.full((3, 3), 0.5)  # in each element, and definite
SMOOTH = {**{name: (getattr(engine, name), [POSITIVE]) for name in MAPS},
          **{name: (op, inputs) for name, (op, _, inputs) in CASES.items()
             if name.split(",")[0] not in WITHOUT_TANGENT}, **MORE}


def directions_of(inputs):
    return [random(*x.shape, seed=9 + i) for i, x in enumerate(inputs)]


@pytest.mark.parametrize("name", SMOOTH)
def test_forward_and_reverse_mode_agree(name):
    f, inputs = SMOOTH[name]
    v = directions_of(inputs)
    value, product = engine.jvp(f, inputs, v)
    u = random(*value.shape, seed=99)
    same, products = engine.vjp(f, inputs, u)
    np.testing.assert_allclose(value, same, rtol=1e-14)
    terms = [np.vdot(p, w) for p, w in zip(products, v)]
    np.testing.assert_allclose(np.vdot(u, product), sum(terms), rtol=1e-9, atol=1e-12 * np.abs(terms).sum())
    assert np.abs(product).max() > 0  # a product of zeros would agree, too


@pytest.mark.parametrize("name", SMOOTH)
def test_hessian_products_are_slopes_of_the_gradient(name):
    f, inputs = SMOOTH[name]
    v, h = directions_of(inputs), 1e-5
    loss = lambda *xs: engine.sum(engine.square(f(*xs)))  # noqa: E731
    value, products = engine.hvp(loss, inputs, v)

    def gradient(s):
        return engine.vjp(loss, [x + s * w for x, w in zip(inputs, v)], np.ones(value.shape))[1]

    for product, above, below in zip(products, gradient(h), gradient(-h)):
        slope = (above - below) / (2 * h)
        np.testing.assert_allclose(product, slope, rtol=1e-4, atol=1e-5 * max(np.abs(slope).max(), 1))


@pytest.mark.parametrize("name", sorted(WITHOUT_TANGENT))
def test_an_op_without_a_tangent_says_so(name):
    f, inputs = CASES[name][0], CASES[name][2]
    for product in (engine.jvp, engine.hvp):
        with pytest.raises(TypeError, match=rf"^\[{name}\] has no tangent, so that no jvp\(\) or hvp\(\) passes"):
            product(f, inputs, directions_of(inputs))


def test_layers_and_eigenvalues_have_no_tangent():
    model = engine.Parameters("float64")
    for f, name in ((engine.Dense(model, "d", 3, 2, seed=1), "Dense"),
                    (engine.symmetric_eigenvalues, "symmetric_eigenvalues")):
        with pytest.raises(TypeError, match=rf"^\[{name}\] has no tangent"):
            engine.jvp(f, [np.eye(3)], [np.eye(3)])
    engine.Dense(model, "free", 3, 2, seed=1)


@pytest.mark.parametrize("dtype, rtol", [("float32", 1e-5), ("float64", 1e-13)])
def test_forward_products_have_the_type_of_their_inputs(dtype, rtol):
    x, v = random(4, dtype=dtype), random(4, dtype=dtype, seed=1)
    value, product = engine.jvp(engine.square, [x], [v])
    loss, (second,) = engine.hvp(lambda a: engine.sum(a ** 3), [x], [v])
    assert value.dtype == product.dtype == second.dtype == dtype and loss.size == 1
    np.testing.assert_allclose(product, 2 * x * v, rtol=rtol)
    np.testing.assert_allclose(second, 6 * x * v, rtol=rtol)


def test_forward_products_name_what_does_not_fit():
    x = np.ones(3)
    for product, word in ((engine.jvp, "jvp"), (engine.hvp, "hvp")):
        for call, error, text in (
                (lambda: product(engine.sum, [], []), ValueError, r"inputs must not be empty"),
                (lambda: product(engine.sum, [x], []), ValueError, r"(tangent|direction)s must be as many as .* 1"),
                (lambda: product(engine.sum, [x], [np.ones(2)]), fm.ShapeError, r"(tangent|direction) 0 must have"),
                (lambda: product(lambda v: 1.0, [x], [x]), TypeError, r"f must return a value of float64, got float"),
                (lambda: product(3, [x], [x]), TypeError, r"f must be a function, got int")):
            with pytest.raises(error, match=rf"^\[{word}\] {text}"):
                call()
        with pytest.raises(TypeError, match=rf"^\[{word}: (tangents|directions): each\] must be of float64, got int64"):
            product(engine.sum, [x], [np.ones(3, "int64")])
    with pytest.raises(fm.ShapeError, match=r"^\[hvp\]"):
        engine.hvp(engine.square, [x], [x])


@pytest.mark.parametrize("make", [
    lambda m: engine.Dense(m, "l", 3, 2, seed=1, relu=True), lambda m: engine.LayerNorm(m, "l", 3),
    lambda m: (lambda layer: lambda x: layer(engine.reshape(x, (1, 2, 2, 3))))(engine.Conv2d(m, "l", 3, 2, seed=1)),
    lambda m: (lambda layer: lambda x: x * layer(x.tape, np.array([2, 0, 2, 1], "int32")))(
        engine.Embedding(m, "l", 5, 3, seed=1))])
def test_gradients_of_parameters_are_checked_on_request(make):
    model = engine.Parameters("float64")
    f = make(model)
    values = [model.values(name).copy() for name in model.names()]
    x = random(4, 3)
    report, alone = engine.gradcheck(f, [x], parameters=model), engine.gradcheck(f, [x])
    assert report.ok, report.table
    assert report.entries > alone.entries
    for name, before in zip(model.names(), values):
        np.testing.assert_array_equal(model.values(name), before)


def test_a_wrong_gradient_of_a_parameter_is_found():
    model = engine.Parameters("float64")
    model.add("w", np.array([2.0, 3.0]))
    wrong = lambda x: x * engine.detach(model.leaf(x.tape, "w"))  # noqa: E731
    assert engine.gradcheck(wrong, [np.ones(2)]).ok and not engine.gradcheck(wrong, [np.ones(2)], parameters=model).ok
    assert engine.gradcheck(lambda x: x * model.leaf(x.tape, "w"), [np.ones(2)], parameters=model).ok
    with pytest.raises(TypeError, match=r"^\[gradcheck\] parameters must be Parameters\(\)"):
        engine.gradcheck(engine.square, [np.ones(2)], parameters=engine.Parameters())


def test_a_tape_of_a_call_makes_constants_and_ends_with_it():
    seen, w = [], random(3)
    _, product = engine.jvp(lambda x: seen.append(x.tape) or x * x.tape.constant(w), [random(3)], [np.ones(3)])
    np.testing.assert_array_equal(product, w)
    array = np.ones(2)
    for call in (lambda: seen[0].constant(array), lambda: seen[0].leaf(array)):
        with pytest.raises(ValueError, match=r"^\[tape\] it belongs to a call that has ended"):
            call()
    array[:] = w[:] = 2  # what was refused or has ended is not held
    model = engine.Parameters("float64")
    layer = engine.Embedding(model, "e", 2, 2, seed=1)
    for call in (lambda: layer(seen[0], np.zeros(1, "int32")), lambda: model.leaf(seen[0], "e/table")):
        with pytest.raises(ValueError, match=r"^\[tape\] it belongs to a call that has ended"):
            call()
    with pytest.raises(ValueError, match=r"^\[reset\] the tape of a call such as gradcheck"):
        seen[0].reset()
    with pytest.raises(ValueError, match=r"^\[Inspector\] the tape of a call such as gradcheck"):
        engine.Inspector(seen[0])
    tape = engine.Tape()
    assert tape.constant(np.ones(1, "float32")).tape is tape


def test_products_name_what_does_not_fit():
    x = np.ones(3)
    for call, error, text in (
            (lambda: engine.vjp(engine.square, [], x), ValueError, r"\[vjp\] inputs must not be empty"),
            (lambda: engine.vjp(engine.square, [x], np.ones(2)), fm.ShapeError, r"\[vjp\].*\[3\].*\[2\]"),
            (lambda: engine.vjp(engine.square, [x], np.ones(3, "float32")), TypeError,
             r"\[vjp: cotangent\] must be of float64, got float32"),
            (lambda: engine.vjp(engine.maximum, [x, np.ones(3, "float32")], x), TypeError,
             r"\[vjp: inputs: each\] must be of float64, got float32"),
            (lambda: engine.vjp(lambda v: 1.0, [x], x), TypeError,
             r"\[vjp\] f must return a value of float64, got float"),
            (lambda: engine.vjp(3, [x], x), TypeError, r"\[vjp\] f must be a function, got int")):
        with pytest.raises(error, match="^" + text):
            call()


def test_an_exception_of_the_function_is_passed_on():
    def f(x):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        engine.vjp(f, [np.ones(3)], np.ones(3))


def test_a_value_of_a_product_is_not_valid_after_it():
    seen = []
    engine.vjp(lambda x: seen.append(x) or engine.square(x), [np.ones(3)], np.ones(3))
    with pytest.raises(ValueError, match=r"^\[value\]"):
        seen[0].numpy()
