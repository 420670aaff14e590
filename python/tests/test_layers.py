"""Layers, roles, schedules, files of state, and the inspector."""

import gc

import numpy as np
import pytest

import fieldmark as fm
from fieldmark import engine


def random(*shape, dtype="float64", seed=0):
    return np.random.default_rng(seed).standard_normal(shape).astype(dtype)


@pytest.mark.parametrize("dtype, rtol", [("float32", 1e-4), ("float64", 1e-12)])
def test_a_dense_layer_is_a_product_with_its_parameters(dtype, rtol):
    model, tape = engine.Parameters(dtype), engine.Tape(dtype)
    layer = engine.Dense(model, "a", 4, 3, seed=1, relu=True)
    assert model.names() == ["a/weight", "a/bias"] and model.role("a/weight") == "matrix"
    w = model.values("a/weight")
    assert w.shape == (4, 3) and 0 < np.abs(w).max() <= np.sqrt(6 / 4)
    x = random(5, 4, dtype=dtype)
    y = layer(tape.constant(x))
    np.testing.assert_allclose(y.numpy(), np.maximum(x @ w, 0), rtol=rtol, atol=rtol)
    engine.sum(y).backward()
    np.testing.assert_allclose(model.grads("a/weight"), x.T @ (x @ w > 0), rtol=rtol)


def test_seeds_tell_layers_apart_and_are_required():
    model = engine.Parameters()
    for name, seed in [("a", 1), ("b", 1), ("c", 2)]:
        engine.Dense(model, name, 3, 2, seed=seed)
    a, b, c = (model.values(name + "/weight") for name in "abc")
    assert (a == b).all() and (a != c).any()
    with pytest.raises(TypeError, match="seed"):
        engine.Dense(model, "d", 3, 2)


def test_a_convolution_sums_its_window():
    model, tape = engine.Parameters("float64"), engine.Tape("float64")
    layer = engine.Conv2d(model, "c", 2, 3, seed=1)
    x, w = random(1, 5, 4, 2), model.values("c/weight")
    padded = np.pad(x, ((0, 0), (1, 1), (1, 1), (0, 0)))
    windows = np.lib.stride_tricks.sliding_window_view(padded, (3, 3), axis=(1, 2))
    np.testing.assert_allclose(layer(tape.constant(x)).numpy(), np.einsum("nijcuv,uvco->nijo", windows, w),
                               atol=1e-12)


def test_a_convolution_takes_stride_and_padding_and_no_bias():
    model, tape = engine.Parameters("float64"), engine.Tape("float64")
    layer = engine.Conv2d(model, "c", 2, 3, seed=1, kernel=2, stride=2, padding=0, bias=False)
    assert model.names() == ["c/weight"]
    x, w = random(1, 4, 6, 2), model.values("c/weight")
    blocks = x.reshape(1, 2, 2, 3, 2, 2)
    np.testing.assert_allclose(layer(tape.constant(x)).numpy(), np.einsum("niujvc,uvco->nijo", blocks, w), atol=1e-12)
    assert layer(tape.constant(x)).shape == (1, 2, 3, 3)
    for options, text in (({"kernel": 2}, "kernel must be odd unless padding is given, got 2"),
                          ({"kernel": 0, "padding": 1}, "kernel must be 1 to 2147483647, got 0"),
                          ({"stride": 0}, "stride must be 1 to 2147483647, got 0"),
                          ({"padding": -1}, "padding must be 0 to 2147483647, got -1")):
        with pytest.raises(ValueError, match=r"^\[Conv2d\] " + text):
            engine.Conv2d(model, "d", 2, 3, seed=1, **options)
    with pytest.raises(TypeError, match=r"^\[Conv2d\] padding must be an integer, got str"):
        engine.Conv2d(model, "d", 2, 3, seed=1, padding="same")


def test_a_dense_layer_without_bias_is_a_product():
    model, tape = engine.Parameters("float64"), engine.Tape("float64")
    layer = engine.Dense(model, "a", 4, 3, seed=1, bias=False)
    assert model.names() == ["a/weight"]
    x = random(5, 4)
    np.testing.assert_allclose(layer(tape.constant(x)).numpy(), x @ model.values("a/weight"), rtol=1e-12)
    with pytest.raises(TypeError, match=r"^\[Dense\] bias must be True or False, got NoneType"):
        engine.Dense(model, "b", 4, 3, seed=1, bias=None)


def test_a_layer_norm_has_the_statistics_of_its_rows():
    model, tape = engine.Parameters("float64"), engine.Tape("float64")
    layer = engine.LayerNorm(model, "n", 4, eps=1e-12)
    assert model.names() == ["n/gamma", "n/beta"]
    model.values("n/gamma")[:], model.values("n/beta")[:] = random(4, seed=1), random(4, seed=2)
    x = random(2, 3, 4)
    want = (x - x.mean(-1, keepdims=True)) / x.std(-1, keepdims=True) * random(4, seed=1) + random(4, seed=2)
    np.testing.assert_allclose(layer(tape.constant(x)).numpy(), want, rtol=1e-9)
    assert engine.gradcheck(layer, [x])
    other = engine.Parameters()
    for call, error, text in (
            (lambda: engine.LayerNorm(other, "m", 0), ValueError, "channels must be 1 to 2147483647, got 0"),
            (lambda: engine.LayerNorm(other, "m", 4, eps=0), ValueError, "eps"),
            (lambda: engine.LayerNorm(other, "m", "4"), TypeError, "channels must be an integer")):
        with pytest.raises(error, match=text):
            call()
    with pytest.raises(fm.ShapeError):
        layer(tape.constant(random(2, 3)))


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_an_embedding_looks_up_rows_and_sums_their_gradients(dtype):
    model, tape = engine.Parameters(dtype), engine.Tape(dtype)
    layer = engine.Embedding(model, "e", 200, 50, seed=3)
    assert model.names() == ["e/table"]
    table = model.values("e/table")
    assert abs(table.mean()) < 0.05 and abs(table.std() - 1) < 0.05
    index, weights = np.array([7, 0, 7], "int32"), random(3, 50, dtype=dtype)
    rows = layer(tape, index)
    np.testing.assert_array_equal(rows.numpy(), table[[7, 0, 7]])
    with pytest.raises(ValueError, match="read-only"):
        index[:] = 0
    engine.sum(rows * tape.constant(weights)).backward()
    want = np.zeros((200, 50), dtype)
    np.add.at(want, index, weights)
    np.testing.assert_allclose(model.grads("e/table"), want, rtol=1e-6)
    tape.reset()
    index[:] = 0


def test_an_embedding_names_what_does_not_fit():
    model, tape = engine.Parameters("float64"), engine.Tape("float64")
    layer = engine.Embedding(model, "e", 3, 2, seed=1)
    for call, error, text in (
            (lambda: engine.Embedding(model, "f", 0, 2, seed=1), ValueError,
             r"\[Embedding\] count must be 1 to 2147483647, got 0"),
            (lambda: engine.Embedding(model, "f", 1, 0, seed=1), ValueError,
             r"\[Embedding\] width must be 1 to 2147483647, got 0"),
            (lambda: layer(engine.Tape(), np.zeros(1, "int32")), TypeError,
             r"\[Embedding\] tape must be Tape\(\) of float64, got Tape_float32"),
            (lambda: layer(tape, [0]), TypeError, r"\[Embedding: index\] must be a numpy array of int32, got list"),
            (lambda: layer(tape, np.zeros((1, 1), "int32")), fm.ShapeError, r"\[Embedding: index\] must have one axis"),
            (lambda: layer(tape, np.array([3], "int32")), ValueError, r"\[.*3")):
        with pytest.raises(error, match="^" + text):
            call()
    engine.Dense(model, "free", 2, 2, seed=1)  # what was refused holds no parameters


def test_a_group_norm_has_the_statistics_of_its_groups():
    model, tape = engine.Parameters("float64"), engine.Tape("float64")
    layer = engine.GroupNorm(model, "g", 4, groups=2)
    y = layer(tape.constant(random(2, 3, 3, 4))).numpy().reshape(2, 9, 2, 2)
    np.testing.assert_allclose(y.mean((1, 3)), 0, atol=1e-12)
    np.testing.assert_allclose(y.var((1, 3)), 1, rtol=1e-3)


def test_a_batch_norm_keeps_running_statistics_that_no_step_changes():
    model, tape = engine.Parameters("float64"), engine.Tape("float64")
    layer = engine.BatchNorm(model, "b", 2)
    adam = engine.Adam(model, lr=0.1, weight_decay=0.5)
    assert [model.role("b/" + name) for name in ("gamma", "running_mean")] == ["trained", "running"]
    x, statistics = random(3, 4, 4, 2) * 3 + 1, engine.BatchStatistics()
    layer(tape.constant(x), statistics)
    np.testing.assert_allclose(statistics.mean, x.mean((0, 1, 2)))
    np.testing.assert_allclose(statistics.variance, x.var((0, 1, 2)))
    layer.update(statistics, momentum=1)
    adam.step()
    np.testing.assert_array_equal(model.values("b/running_variance"), statistics.variance)
    np.testing.assert_array_equal(model.values("b/gamma"), 1 - 0.1 * 0.5)
    tape.reset()
    y = layer.evaluate(tape.constant(x)).numpy()
    np.testing.assert_allclose(y.std((0, 1, 2)), 0.95, rtol=1e-4)
    with pytest.raises(fm.ShapeError):
        layer.update(engine.BatchStatistics())


def test_a_running_parameter_is_a_constant():
    model, tape = engine.Parameters("float64"), engine.Tape("float64")
    model.add("mean", np.ones(2), role="running")
    assert not model.leaf(tape, "mean").needs_grad
    with pytest.raises(ValueError, match="role must be trained, matrix, table or running, got 'frozen'"):
        engine.Parameters("float64").add("other", np.ones(2), role="frozen")


def test_layers_are_added_before_memory_is_referred_to():
    model = engine.Parameters()
    engine.Dense(model, "a", 2, 2, seed=1)
    adam = engine.Adam(model)
    with pytest.raises(BufferError, match=r"\[Dense\] 1 arrays, passes or optimisers refer to the parameters"):
        engine.Dense(model, "b", 2, 2, seed=1)
    del adam
    gc.collect()
    with pytest.raises(ValueError, match="a/weight"):
        engine.Dense(model, "a", 2, 2, seed=1)
    with pytest.raises(TypeError, match=r"\[Dense\] parameters must be Parameters\(\), got dict"):
        engine.Dense({}, "a", 2, 2, seed=1)


def test_the_gradient_behind_a_relu_is_kept_on_request():
    model, tape = engine.Parameters("float64"), engine.Tape("float64")
    layer = engine.Dense(model, "a", 3, 3, seed=1, relu=True)
    x = random(4, 3)
    h = layer(tape.constant(x))
    engine.sum(engine.square(h)).backward()
    with pytest.raises(ValueError, match="keep_grad"):
        h.grad
    with pytest.raises(ValueError, match="before the backward"):
        tape.keep_grad(h)
    tape.reset()
    h = tape.keep_grad(layer(tape.constant(x)))
    engine.sum(h * 2 + 1).backward()
    np.testing.assert_array_equal(h.grad, np.full((4, 3), 2.0))


def test_schedules():
    assert [engine.cosine_decay(n, 4, 0.5) for n in (0, 2, 4, 9)] == pytest.approx([1, 0.75, 0.5, 0.5])
    assert [engine.step_decay(n, 10) for n in (9, 10, 20)] == pytest.approx([1, 0.1, 0.01])
    assert engine.exponential_decay(3, 0.5) == 0.125
    assert [engine.warm_up(n, 4) for n in (0, 1, 3, 8)] == [0.25, 0.5, 1, 1]
    with pytest.raises(ValueError, match="steps"):
        engine.cosine_decay(1, 0)


def take_step(model, optimiser, tape):
    tape.reset()
    model.zero_grad()
    engine.sum(engine.square(model.leaf(tape, "w") - 1)).backward()
    optimiser.step()


@pytest.mark.parametrize("make", [lambda m: engine.Adam(m, lr=0.1), lambda m: engine.Sgd(m, lr=0.1, momentum=0.9),
                                  lambda m: engine.Muon(m, ["w"], lr=0.1)])
def test_a_saved_state_goes_on_with_the_same_bits(make, tmp_path):
    def begin():
        model = engine.Parameters("float64")
        model.add("w", random(5, 2))
        return model, make(model), engine.Tape("float64")

    model, optimiser, tape = begin()
    for _ in range(3):
        take_step(model, optimiser, tape)
    file = engine.SafetensorsFile()
    engine.save_state(file, "model/", model, optimiser)
    file.write(tmp_path / "state")
    take_step(model, optimiser, tape)

    again, other, tape = begin()
    file = engine.SafetensorsFile.read(tmp_path / "state")
    assert "model/w" in file.names()
    engine.load_state(file, "model/", again, other)
    assert getattr(other, "steps", 3) == 3
    take_step(again, other, tape)
    np.testing.assert_array_equal(again.values("w"), model.values("w"))


def test_one_module_is_saved_and_loaded_under_another_name():
    first, second = engine.Parameters("float64"), engine.Parameters("float64")
    for model, module in (first, "encoder"), (second, "reader"):
        model.add(f"{module}/w", random(5, 2) + len(module))
        model.add("other/w", random(3) + len(module))
    kept = second.values("other/w").copy()
    file = engine.SafetensorsFile()
    engine.save_state(file, "part/", first, module="encoder")
    assert file.names() == ["part/w"]
    engine.load_state(file, "part/", second, module="reader")
    np.testing.assert_array_equal(second.values("reader/w"), first.values("encoder/w"))
    np.testing.assert_array_equal(second.values("other/w"), kept)
    with pytest.raises(fm.ValueError_, match="decoder"):
        engine.save_state(file, "", first, module="decoder")


def test_muon_leaves_the_other_tensors_to_adam(tmp_path):
    def begin():
        model = engine.Parameters("float64")
        model.add("w", random(5, 2))
        model.add("b", random(2))
        return model, engine.Muon(model, ["w"], lr=0.1), engine.Adam(model, lr=0.1), engine.Tape("float64")

    def step(model, muon, adam, tape):
        tape.reset()
        model.zero_grad()
        engine.sum(engine.square(model.leaf(tape, "w") + model.leaf(tape, "b"))).backward()
        muon.step()
        w = model.values("w").copy()
        adam.step()
        np.testing.assert_array_equal(model.values("w"), w)

    one, two = begin(), begin()
    for _ in range(3):
        step(*one)
    file = engine.SafetensorsFile()
    engine.save_state(file, "muon/", one[0], one[1])
    engine.save_state(file, "adam/", one[0], one[2])
    engine.load_state(file, "muon/", two[0], two[1])
    engine.load_state(file, "adam/", two[0], two[2])
    for run in (one, two):
        step(*run)
    for name in ("w", "b"):
        np.testing.assert_array_equal(two[0].values(name), one[0].values(name))


def test_states_that_do_not_fit_are_refused_and_change_nothing(tmp_path):
    model, other, file = engine.Parameters(), engine.Parameters(), engine.SafetensorsFile()
    model.add("w", np.ones(3, "float32"))
    other.add("w", np.zeros(2, "float32"))
    adam = engine.Adam(model)
    engine.save_state(file, "", model)
    names = file.names()
    with pytest.raises(ValueError, match="w"):
        engine.save_state(file, "", model, adam)
    assert file.names() == names
    with pytest.raises(fm.IoError, match="w"):
        engine.load_state(file, "", other)
    with pytest.raises(fm.IoError, match="adam/steps"):
        engine.load_state(file, "", model, adam)
    with pytest.raises(ValueError, match="the optimiser is one of other parameters"):
        engine.load_state(file, "", other, adam)
    with pytest.raises(TypeError, match="optimiser must be Adam, Sgd or Muon of float32 parameters, or None, got int"):
        engine.save_state(file, "b/", model, 3)
    assert (other.values("w") == 0).all() and (model.values("w") == 1).all()
    with pytest.raises(fm.IoError, match="nowhere"):
        engine.SafetensorsFile.read(tmp_path / "nowhere")
    with pytest.raises(fm.IoError):
        file.write(tmp_path / "nowhere" / "state")


def test_the_inspector_shows_graph_and_costs():
    tape = engine.Tape()
    with engine.Inspector(tape) as inspector:
        x = tape.name(tape.leaf(np.ones((2, 3), "float32")), "input")
        engine.sum(engine.square(x)).backward()
        text, dot = inspector.text(), inspector.dot()
        assert "input" in text and "square" in text and "[2, 3]" in text
        assert dot.startswith("digraph") and "square" in dot
        cost = {c.op: c for c in inspector.costs()}["square"]
        assert cost.calls == 1 and cost.forward_bytes >= 24 and cost.forward_seconds >= 0
        assert cost.backward_bytes >= 0 and cost.backward_seconds >= 0
        assert "square" in inspector.cost_table()
        with pytest.raises(ValueError, match="inspector"):
            engine.Inspector(tape)
    with pytest.raises(ValueError, match="closed"):
        inspector.text()
    engine.Inspector(tape).close()
    with pytest.raises(ValueError, match="another tape"):
        engine.Tape().name(x, "x")
    with pytest.raises(TypeError, match=r"tape must be Tape\(\), got int"):
        engine.Inspector(3)


def test_the_inspector_measures_values_and_gradients_on_request():
    tape, model = engine.Tape("float64"), engine.Parameters("float64")
    model.add("w", np.array([3.0, 0.0, -4.0]))
    with engine.Inspector(tape, statistics=True) as inspector:
        for _ in range(2):
            model.zero_grad()
            square = tape.name(engine.square(model.leaf(tape, "w")), "square")
            engine.sum(square).backward()
            tape.reset()
        values, gradients = inspector.value_stats()["square"], inspector.gradient_stats()["w"]
    assert values["count"] == gradients["count"] == 6 and gradients["zeros"] == 2 and gradients["nonfinite"] == 0
    assert values["mean"] == pytest.approx(25 / 3) and gradients["mean"] == pytest.approx(-2 / 3)
    assert gradients["rms"] == pytest.approx(np.sqrt(100 / 3)) and gradients["largest"] == 8
    with engine.Inspector(tape) as inspector:
        for name in ("value_stats", "gradient_stats"):
            with pytest.raises(ValueError, match=rf"^\[Inspector.{name}\] needs Inspector\(tape, statistics=True\)"):
                getattr(inspector, name)()


@pytest.mark.parametrize("f, way", [(lambda x: engine.log(x), "log"), (lambda x: engine.sqrt(x), "backward of sqrt")])
def test_the_inspector_stops_at_the_first_nan(f, way):
    tape = engine.Tape("float64")
    with engine.Inspector(tape, stop_at_nonfinite=True):
        with pytest.raises(ValueError, match=way + r".* made the first"):
            engine.sum(f(tape.leaf(np.array([1.0, 0.0])))).backward()
