"""Products with Jacobians."""

import numpy as np
import pytest

import fieldmark as fm
from fieldmark import engine


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


def test_products_name_what_does_not_fit():
    x = np.ones(3)
    for call, error, text in (
            (lambda: engine.vjp(engine.square, [], x), ValueError, r"\[vjp\] inputs must not be empty"),
            (lambda: engine.vjp(engine.square, [x], np.ones(2)), fm.ShapeError, r"\[vjp\].*\[3\].*\[2\]"),
            (lambda: engine.vjp(engine.square, [x], np.ones(3, "float32")), TypeError,
             r"\[vjp: cotangent\] must be of float64, got float32"),
            (lambda: engine.vjp(engine.maximum, [x, np.ones(3, "float32")], x), TypeError,
             r"\[vjp: inputs: each\] must be of float64, got float32"),
            (lambda: engine.vjp(lambda v: 1.0, [x], x), TypeError, r"\[vjp\] f must return a value of float64, got float"),
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
