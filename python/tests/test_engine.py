"""Arrays in and out, gradients beside numpy's arithmetic, and the errors of what dies or does not fit."""

import gc
import os
import re
import signal

import numpy as np
import pytest

import fieldmark as fm
from fieldmark import engine


def random(*shape, dtype="float64", seed=0):
    return np.random.default_rng(seed).standard_normal(shape).astype(dtype)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_values_and_gradients_are_those_of_numpy(dtype):
    tape = engine.Tape(dtype)
    a, b = random(3, 4, dtype=dtype), random(4, dtype=dtype, seed=1)
    x, y = tape.leaf(a), tape.leaf(b)
    z = engine.mean((x * y - 0.5) ** 2.0 / 3.0)
    assert z.item() == pytest.approx(np.mean((a * b - 0.5) ** 2 / 3), rel=1e-5)
    z.backward()
    slope = 2 * (a * b - 0.5) / 3 / a.size
    np.testing.assert_allclose(x.grad, slope * b, rtol=1e-4)
    np.testing.assert_allclose(y.grad, (slope * a).sum(0), rtol=1e-4)


def test_arrays_are_neither_copied_in_nor_out():
    tape = engine.Tape("float64")
    a = random(5)
    x = tape.constant(a)
    assert np.shares_memory(x.numpy(), a)
    y = (x + 1.0).numpy()
    assert not y.flags.writeable and not y.flags.owndata


def test_gradients_are_added_to_the_array_given():
    tape, a, grad = engine.Tape("float64"), random(3), np.ones(3)
    engine.sum(engine.square(tape.leaf(a, grad))).backward()
    np.testing.assert_allclose(grad, 1 + 2 * a)


def test_reset_refuses_while_an_array_shows_the_pass():
    tape = engine.Tape("float64")
    shown = engine.exp(tape.constant(random(3))).numpy()
    with pytest.raises(BufferError, match="1 arrays show values of this pass"):
        tape.reset()
    kept = np.array(shown)
    del shown
    gc.collect()
    tape.reset()
    assert np.isfinite(kept).all()


def test_a_value_of_a_forgotten_pass_is_refused():
    tape = engine.Tape("float64")
    x = tape.leaf(random(3))
    tape.reset()
    with pytest.raises(ValueError, match="forgotten"):
        x + 1.0


def test_an_array_outlives_its_tape():
    shown = engine.square(engine.Tape("float64").constant(np.arange(4.0))).numpy()
    gc.collect()
    np.testing.assert_array_equal(shown, [0, 1, 4, 9])


def test_an_input_that_dies_early_is_kept():
    tape = engine.Tape("float64")
    x = tape.leaf(np.full(1000, 2.0))
    gc.collect()
    np.random.rand(1000)
    engine.sum(engine.square(x)).backward()
    np.testing.assert_array_equal(x.grad, np.full(1000, 4.0))


@pytest.mark.parametrize("given, error, text", [
    (np.ones(3, "float32"), TypeError, r"must be of float64, got float32: convert it with x.astype"),
    (np.ones((4, 4))[:, ::2], ValueError, "must be contiguous in row-major order"),
    (np.ones((4, 3)).T, ValueError, "must be contiguous in row-major order"),
    ([1.0, 2.0], TypeError, "must be a numpy array of float64, got list"),
    (np.ones((1,) * 6), fm.ShapeError, "at most 5 axes, got 6"),
])
def test_arrays_that_do_not_fit_are_refused(given, error, text):
    with pytest.raises(error, match=text):
        engine.Tape("float64").constant(given)


def test_shapes_that_do_not_fit_are_refused():
    tape = engine.Tape("float64")
    a, b = tape.constant(random(3, 4)), tape.constant(random(3))
    with pytest.raises(fm.ShapeError, match="must broadcast"):
        a + b
    with pytest.raises(fm.ShapeError, match=r"\[sum\]"):
        engine.sum(a, axis=2)
    with pytest.raises(fm.ShapeError, match="nothing|elements to reduce"):
        engine.mean(tape.constant(np.ones((0, 3))))
    with pytest.raises(ValueError, match="singular"):
        engine.solve(tape.constant(np.zeros((2, 2))), tape.constant(np.ones((2, 1))))
    with pytest.raises(ValueError, match="another tape"):
        a + engine.Tape("float64").constant(random(3, 4))


def test_types_are_not_mixed():
    with pytest.raises(TypeError):
        engine.Tape("float64").constant(random(3)) + engine.Tape("float32").constant(random(3, dtype="float32"))
    with pytest.raises(TypeError, match="float32 or float64, got int32"):
        engine.Tape("int32")


def test_statistics_of_gradients_and_values_by_name():
    model, tape = engine.Parameters("float64"), engine.Tape("float64")
    model.add("net/w", np.array([3.0, -4.0, 0.0, 0.0]))
    model.add("net/b", np.array([np.nan, 2.0]))
    engine.sum(engine.square(model.leaf(tape, "net/w"))).backward()
    model.grads("net/b")[:] = [np.inf, 0.0]
    stats = model.gradient_stats()
    assert list(stats) == ["net/w", "net/b"]
    assert stats["net/w"] == {"count": 4, "zeros": 2, "nonfinite": 0, "mean": -0.5, "rms": 5.0, "largest": 8.0}
    assert stats["net/b"] == {"count": 2, "zeros": 1, "nonfinite": 1, "mean": 0.0, "rms": 0.0, "largest": 0.0}
    values = model.value_stats()
    assert values["net/w"]["rms"] == 2.5 and values["net/b"]["mean"] == 2.0 and values["net/b"]["nonfinite"] == 1


def test_ops_have_the_gradients_of_differences():
    a, b = random(2, 3, 3, seed=1), random(2, 3, 2, seed=2)
    spd = a @ a.transpose(0, 2, 1) + 3 * np.eye(3)
    index = np.array([2, 0], "int32")
    for f, inputs in [
        (lambda x: engine.softmax(engine.logsumexp(x, axis=1), axis=-1), [a]),
        (lambda x, y: engine.solve(x, y), [spd, b]),
        (lambda x: engine.log_determinant(x), [spd]),
        (lambda x: engine.gather(x, 1, index), [a]),
        (lambda x, y: x @ y, [a, b]),
        (lambda x, y: engine.concatenate([x, y], axis=2), [a, b]),
        (lambda x, gamma, beta: engine.gelu(engine.layer_norm(x, gamma, beta)), [a, random(3, seed=3), random(3)]),
    ]:
        report = engine.gradcheck(f, inputs)
        assert report.ok, report.table


def test_gradcheck_finds_a_wrong_gradient_and_forgets_its_tape():
    kept = []

    def wrong(x):
        kept.append(x)
        return x * engine.detach(x)

    report = engine.gradcheck(wrong, [random(3)])
    assert not report.ok and report.table
    with pytest.raises(ValueError, match="forgotten"):
        kept[0].numpy()


def test_arrays_from_within_gradcheck_are_copies_and_values_end_with_their_call():
    arrays, values, refused = [], [], []

    def f(x):
        if values:
            with pytest.raises(ValueError, match="forgotten"):
                values[-1].numpy()
            refused.append(True)
        y = x * x
        arrays.append((x.numpy(), y.numpy()))
        values.append(y)
        return y

    assert engine.gradcheck(f, [np.array([3.0, 4.0])]).ok
    assert refused
    for x, y in arrays:
        np.testing.assert_allclose(y, x * x)


def test_backward_notices_a_step_if_parameters_came_as_arrays():
    model = engine.Parameters()
    model.add("w", np.array([2.0, 3.0], "float32"))
    sgd, tape = engine.Sgd(model, lr=1.0), engine.Tape()
    x = np.ones(2, "float32")
    for record in (tape.constant, tape.leaf):
        loss = engine.sum(record(model.values("w")) * tape.constant(x))
        sgd.step()
        with pytest.raises(ValueError, match="parameters have changed"):
            loss.backward()
        del loss
        tape.reset()


def test_a_report_of_gradcheck_is_its_verdict():
    good = engine.gradcheck(engine.square, [np.ones(2)])
    bad = engine.gradcheck(lambda x: engine.detach(x) * x, [np.ones(2)])
    assert good and not bad
    assert re.match(r"<fieldmark gradcheck, ok: worst error \S+ of 2 entries>$", repr(good))
    assert repr(bad).startswith("<fieldmark gradcheck, failed: worst error ")


def test_comparisons_give_numbers():
    x = engine.Tape("float64").leaf(np.array([1.0, 2.0, np.nan]))
    for y, want in ((x < 2, [1, 0, 0]), (x > 1, [0, 1, 0]), (1.5 > x, [1, 0, 0]), (np.float64(1.5) < x, [0, 1, 0]),
                    (x < x * x, [0, 1, 0])):
        np.testing.assert_array_equal(y.numpy(), want)
        assert not y.needs_grad
    with pytest.raises(TypeError, match=r"^\[<\] must be a value of float64 or a number, got ndarray: pass it as"):
        x < np.ones(3)
    y = engine.where(x > 1.5, x * 3, x)
    engine.sum(y).backward()
    np.testing.assert_array_equal(x.grad, [1, 3, 1])


def test_the_text_of_a_value_tells_whether_it_holds():
    tape = engine.Tape()
    x = tape.constant(np.ones((2, 3), "float32"))
    assert repr(x) == "<fieldmark value [2, 3] of float32>"
    tape.reset()
    assert repr(x) == "<fieldmark value of float32, forgotten by Tape.reset()>"


def test_the_next_backward_overwrites_gradients():
    tape = engine.Tape("float64")
    x = tape.leaf(np.ones(3))
    np.testing.assert_array_equal(x.grad, 0)
    y = x * 2
    assert y.grad is None
    engine.sum(y).backward()
    seen = y.grad
    (engine.sum(y) * 5).backward()
    np.testing.assert_array_equal(seen, 5)
    np.testing.assert_array_equal(x.grad, 12)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system does not fork")
def test_a_forked_child_computes_on_one_thread():
    before = engine.Tape()
    x = np.random.default_rng(0).standard_normal((512, 512)).astype("float32")
    a = before.constant(x)
    want = engine.matmul(a, a).numpy()  # starts the threads of the parent
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            signal.alarm(60)
            b = engine.Tape().constant(x)
            same = np.array_equal(engine.matmul(b, b).numpy(), want)
            os.write(writer, f"{fm.threads()} {same}".encode())
        finally:
            os._exit(0)
    os.close(writer)
    assert os.read(reader, 100) == b"1 True"
    os.waitpid(child, 0)
    os.close(reader)


def test_threads_beyond_what_can_be_started_are_refused():
    import fieldmark

    with pytest.raises(ValueError, match="1 to 1024"):
        fieldmark.set_threads(1_000_000)


def test_a_line_is_fitted():
    x = random(64, 3, dtype="float32")
    y = x @ np.array([[1], [-2], [0.5]], "float32") + 3
    model = engine.Parameters()
    model.add("w", np.zeros((3, 1), "float32"))
    model.add("b", np.zeros(1, "float32"))
    adam, tape = engine.Adam(model, lr=0.05), engine.Tape()
    for _ in range(400):
        w, b = model.leaf(tape, "w"), model.leaf(tape, "b")
        loss = engine.mse_loss(engine.dense(tape.constant(x), w, b), tape.constant(y))
        loss.backward()
        last = loss.item()
        adam.step()
        model.zero_grad()
        tape.reset()
    assert last < 1e-4
    np.testing.assert_allclose(model.values("w").ravel(), [1, -2, 0.5], atol=0.02)


def test_parameters_refuse_more_while_memory_is_referred_to():
    model = engine.Parameters("float64")
    model.add("w", np.ones(3))
    shown = model.values("w")
    with pytest.raises(BufferError, match="add all of them first"):
        model.add("b", np.ones(1))
    shown[:] = 2
    del shown
    gc.collect()
    model.add("b", np.ones(1))
    np.testing.assert_array_equal(model.values("w"), [2, 2, 2])
    with pytest.raises(ValueError):
        model.add("w", np.ones(1))
