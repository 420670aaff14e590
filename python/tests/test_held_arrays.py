"""The arrays that a pass reads or adds to: read-only, kept alive, and never both."""

import gc

import numpy as np
import pytest

import fieldmark as fm
from fieldmark import engine


def test_a_gradient_must_be_writeable_and_of_its_own(tape):
    a, grad = np.ones(3), np.zeros(3)
    grad.flags.writeable = False
    with pytest.raises(ValueError, match=r"^\[leaf: grad\] must be writeable, since backward adds to it"):
        tape.leaf(a, grad)
    with pytest.raises(ValueError, match=r"^\[leaf\] grad shares memory with an array that this pass reads"):
        tape.leaf(a, a)
    a[0] = 2  # what was refused is not held
    both = np.ones(5)
    with pytest.raises(ValueError, match="shares memory"):
        tape.leaf(both[:3], both[2:])
    tape.leaf(both[:2], both[2:4])
    with pytest.raises(ValueError, match=r"^\[constant: array\] shares memory with a gradient of this pass"):
        tape.constant(both[3:])
    with pytest.raises(fm.ShapeError, match=r"grad must have the shape of the array, \[3\], got \[1, 3\]"):
        tape.leaf(np.ones(3), np.zeros((1, 3)))


def test_a_gradient_is_not_a_parameter_that_the_pass_reads(tape):
    model = engine.Parameters("float64")
    model.add("w", np.ones(3))
    model.leaf(tape, "w")
    with pytest.raises(ValueError, match="shares memory with an array that this pass reads"):
        tape.leaf(np.ones(3), model.values("w"))
    tape.leaf(np.ones(3), model.grads("w"))  # adds up
    with pytest.raises(ValueError, match="shares memory with a gradient"):
        tape.constant(model.grads("w"))


def test_a_seed_has_the_shape_of_its_value(x):
    with pytest.raises(fm.ShapeError, match=r"seed must have the shape of the value, \[4, 6\], got \[6, 4\]"):
        x.backward(np.ones((6, 4)))
    with pytest.raises(fm.ShapeError, match=r"\[backward\] loss must have one element, got shape \[4, 6\]"):
        x.backward()


def test_weights_have_the_shape_of_what_they_weigh(x):
    for call in (lambda: engine.mse_loss(x, x, np.ones((6, 4))), lambda: engine.weighted_mean(x, np.ones(24)),
                 lambda: engine.bce_with_logits(x, np.ones(24)),
                 lambda: engine.softmax_cross_entropy(x, np.zeros(4, "int32"), np.ones((4, 1)))):
        with pytest.raises(fm.ShapeError, match=r"must have shape \[4(, 6)?\], got"):
            call()
    with pytest.raises(ValueError, match="weight"):
        engine.mse_loss(x, x, np.full((4, 6), -1.0))
    with pytest.raises(ValueError, match="mode must be bilinear or nearest, got 'cubic'"):
        engine.upsample_to(x, 2, 2, mode="cubic")


def test_arrays_of_a_pass_are_read_only_until_reset(tape):
    data = np.ones((4, 3))
    part, index, weights = data[:2], np.array([1, 0], "int32"), np.ones((2, 3))
    x = tape.leaf(part)
    y = engine.mse_loss(engine.gather(x, 0, index), tape.constant(np.zeros((2, 3))), weights)
    for array in (data, part, index, weights):
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 0
    y.backward()
    tape.reset()
    for array in (data, part, index, weights):
        array[:] = 0


def test_an_array_of_two_tapes_is_read_only_until_both_let_go():
    a, b, array = engine.Tape(), engine.Tape(), np.ones(3, "float32")
    a.constant(array), a.constant(array), b.constant(array)
    a.reset()
    assert not array.flags.writeable
    del b
    gc.collect()
    assert array.flags.writeable


def test_arrays_that_were_read_only_stay_so(tape):
    array = np.ones(3)
    array.flags.writeable = False
    tape.constant(array)
    tape.reset()
    assert not array.flags.writeable


def test_indices_labels_and_weights_that_die_early_are_kept(tape, x):
    losses = [engine.softmax_cross_entropy(engine.gather(x, 0, np.array([2, 0], "int32")),
                                           np.array([1, 5], "int32"), np.array([1.0, 3.0])),
              engine.mse_loss(x, tape.constant(np.zeros((4, 6))), np.full((4, 6), 2.0))]
    gc.collect()
    rubbish = [np.full(n, 7, "int32") for n in (2, 2, 4, 48)] * 50
    engine.sum(losses[0]).backward()
    rows = x.numpy()[[2, 0]]
    slope = np.exp(rows) / np.exp(rows).sum(-1, keepdims=True) - np.eye(6)[[1, 5]]
    np.testing.assert_allclose(x.grad[[2, 0]], slope * [[0.25], [0.75]])
    assert rubbish and np.isfinite(losses[1].item())


def test_a_tape_does_not_read_its_own_values(tape, x):
    shown = engine.exp(x).numpy()
    with pytest.raises(ValueError, match=r"shows a value of the same tape: pass x.copy\(\), or use engine.detach"):
        tape.constant(shown)
    with pytest.raises(ValueError, match="shows a value of the same tape"):
        tape.constant(shown[1:])
    other = engine.Tape("float64")
    other.constant(shown)
    del shown
    with pytest.raises(BufferError):
        tape.reset()
    other.reset()
    gc.collect()
    tape.reset()


def test_backward_refuses_parameters_that_have_changed(tape):
    model = engine.Parameters("float64")
    model.add("w", np.ones(3))
    sgd = engine.Sgd(model, lr=0.1)
    loss = engine.sum(engine.square(model.leaf(tape, "w")))
    loss.backward()
    sgd.step()
    with pytest.raises(ValueError, match="the parameters have changed since this pass read them: record it again"):
        loss.backward()
