"""One clear error for each input that does not fit, and nothing wrong in silence."""

import re

import numpy as np
import pytest

import fieldmark as fm
from fieldmark import engine

OTHER_LAYOUTS = [
    (np.ones((4, 6), "float32"), TypeError, r"must be of float64, got float32: convert it with x.astype\('float64'\)"),
    (np.ones((4, 6), ">f8"), TypeError, r"must be of float64, got >f8"),
    (np.ones((4, 12))[:, ::2], ValueError, r"must be contiguous in row-major order: pass numpy.ascontiguousarray\(x\)"),
    (np.ones((6, 4)).T, ValueError, "must be contiguous in row-major order"),
    (np.frombuffer(bytearray(8 * 24 + 1), "float64", 24, 1).reshape(4, 6), ValueError,
     r"must be aligned to the 8 bytes of its elements: pass x.copy\(\)"),
    (np.ma.masked_array(np.ones((4, 6)), False), TypeError, r"must not be masked: pass x.filled\(value\)"),
    ([[1.0]], TypeError, "must be a numpy array of float64, got list"),
    (None, TypeError, "must be a numpy array of float64, got NoneType"),
]
INDICES = [
    (np.array([0, 1]), TypeError, r"must be of int32, got int64: convert it with x.astype\('int32'\)"),
    (np.array([0.0, 1.0]), TypeError, "must be of int32, got float64"),
    (np.array([0, 1], "uint32"), TypeError, "must be of int32, got uint32"),
    (np.arange(4, dtype="int32")[::2], ValueError, "must be contiguous"),
    (np.frombuffer(bytearray(9), "int32", 2, 1), ValueError, "must be aligned to the 4 bytes"),
    ([0, 1], TypeError, "must be a numpy array of int32, got list"),
    (np.zeros((1, 2), "int32"), fm.ShapeError, "must have"),
]


@pytest.mark.parametrize("array, error, text", OTHER_LAYOUTS)
def test_every_place_that_takes_an_array_checks_it(tape, x, array, error, text):
    places = {
        "constant: array": lambda: tape.constant(array),
        "leaf: array": lambda: tape.leaf(array),
        "mse_loss: weights": lambda: engine.mse_loss(x, x, array),
        "weighted_mean: weights": lambda: engine.weighted_mean(x, array),
        "bce_with_logits: targets": lambda: engine.bce_with_logits(x, array),
        "Parameters.add: values": lambda: engine.Parameters("float64").add("w", array),
        "gradcheck: inputs: each": lambda: engine.gradcheck(engine.sum, [array]),
        "batch_norm_fixed: mean": lambda: engine.batch_norm_fixed(x, x, x, array, array),
        "leaf: grad": lambda: tape.leaf(np.ones((4, 6)), array),
        "backward: seed": lambda: x.backward(array),
    }
    if array is None:  # these have a default
        for name in ("mse_loss: weights", "leaf: grad", "backward: seed"):
            del places[name]
    for name, call in places.items():
        with pytest.raises(error, match=rf"^\[{name}\] {text}"):
            call()


@pytest.mark.parametrize("array, error, text", INDICES)
def test_indices_and_labels_are_int32(x, array, error, text):
    rows = engine.slice(x, 0, 0, 2)
    for name, call in {
        "gather: index": lambda: engine.gather(x, 0, array),
        "scatter_add: index": lambda: engine.scatter_add(rows, 0, array, 4),
        "softmax_cross_entropy: labels": lambda: engine.softmax_cross_entropy(rows, array),
    }.items():
        with pytest.raises(error, match=rf"^\[{name}\] {text}"):
            call()


def test_indices_out_of_range_are_refused_and_can_be_mended(x):
    index = np.array([0, 4], "int32")
    with pytest.raises(ValueError, match=r"\[gather\].*4"):
        engine.gather(x, 0, index)
    index[1] = 3  # an op that failed holds nothing
    engine.gather(x, 0, index)
    with pytest.raises(ValueError, match=r"\[scatter_add\]"):
        engine.scatter_add(engine.slice(x, 0, 0, 2), 0, index, 2)
    with pytest.raises(ValueError, match=r"\[softmax_cross_entropy\].*6"):
        engine.softmax_cross_entropy(x, np.array([0, 1, 2, 6], "int32"))


@pytest.mark.parametrize("axis", [2, -3])
def test_axes_out_of_range_are_refused(x, axis):
    index = np.array([0], "int32")
    for name, call in {
        "softmax": lambda: engine.softmax(x, axis),
        "slice": lambda: engine.slice(x, axis, 0, 1),
        "permute": lambda: engine.permute(x, (0, axis)),
        "gather": lambda: engine.gather(x, axis, index),
        "scatter_add": lambda: engine.scatter_add(x, axis, index, 4),
        "pad": lambda: engine.pad(x, axis, 1, 1),
        "cumsum": lambda: engine.cumsum(x, axis),
        "transpose": lambda: engine.transpose(x, 0, axis),
        "concatenate": lambda: engine.concatenate([x, x], axis),
        "max": lambda: engine.max(x, axis),
        "logsumexp": lambda: engine.logsumexp(x, (0, axis)),
    }.items():
        with pytest.raises(fm.ShapeError, match=rf"^\[{name}\].*{axis}"):
            call()


@pytest.mark.parametrize("axis", ["x", 1.5, [0, "y"], np.array([0.5])])
def test_axes_that_are_no_integers_are_refused(x, axis):
    with pytest.raises(TypeError, match=r"^\[sum\] axis must be None, an integer or a sequence of integers, got "):
        engine.sum(x, axis)


def test_axes_named_twice_are_refused(x):
    with pytest.raises(ValueError, match=r"^\[sum\]"):
        engine.sum(x, (0, -2))
    with pytest.raises(ValueError, match=r"^\[permute\]"):
        engine.permute(x, (0, 0))


def test_reductions_of_nothing_are_refused(tape):
    nothing = tape.leaf(np.ones((0, 3)))
    for name in ("mean", "max", "variance", "logsumexp"):
        with pytest.raises(fm.ShapeError, match=rf"^\[{name}\]"):
            getattr(engine, name)(nothing)
        with pytest.raises(fm.ShapeError, match=rf"^\[{name}\]"):
            getattr(engine, name)(nothing, axis=0)
    with pytest.raises(fm.ShapeError, match=r"^\[softmax\]"):
        engine.softmax(nothing, 0)
    assert engine.sum(nothing).item() == 0


@pytest.mark.parametrize("shape", [(-4, -6), (-1, 6), (2 ** 32, 2 ** 32), (2, 3)])
def test_shapes_that_cannot_be_are_refused(tape, x, shape):
    with pytest.raises(fm.ShapeError, match=r"^\[(reshape|shape)\]"):
        engine.reshape(x, shape)
    with pytest.raises(fm.ShapeError, match=r"^\[(broadcast_to|shape)\]"):
        engine.broadcast_to(x, shape)


@pytest.mark.parametrize("name", ["inverse", "cholesky", "log_determinant"])
@pytest.mark.parametrize("matrix", [np.zeros((2, 2)), np.ones((3, 3)), np.array([[np.nan, 0], [0, 1]])])
def test_singular_matrices_are_refused(tape, name, matrix):
    with pytest.raises(ValueError, match=rf"^\[{name}\]"):
        getattr(engine, name)(tape.leaf(matrix))


def test_singular_matrices_are_refused_by_solvers(tape):
    a, b = tape.constant(np.diag([1.0, 0.0])), tape.constant(np.ones((2, 1)))
    for name in ("solve", "triangular_solve"):
        with pytest.raises(ValueError, match=rf"^\[{name}\].*singular"):
            getattr(engine, name)(a, b)
    with pytest.raises(fm.ShapeError, match=r"^\[inverse\]"):
        engine.inverse(b)


def test_muon_takes_a_list_of_patterns_of_matrices():
    model = engine.Parameters("float64")
    model.add("w", np.ones((3, 2)))
    model.add("b", np.ones(2))
    with pytest.raises(TypeError, match="names must be a list of patterns, got str"):
        engine.Muon(model, "w")
    with pytest.raises(ValueError, match="no trained parameter of the store has a name like 'x'"):
        engine.Muon(model, ["x"])
    with pytest.raises(ValueError, match="'b' must have two axes or more"):
        engine.Muon(model, ["*"])


@pytest.mark.parametrize("other, got", [
    (np.ones(3), r"got ndarray: pass it as tape.constant\(x\)"), (np.ones(1), "got ndarray"), ("x", "got str"),
    (None, "got NoneType"), (engine.Tape().constant(np.ones(3, "float32")), "got Value_float32")])
def test_operators_take_values_and_numbers(tape, other, got):
    x = tape.constant(np.ones(3))
    for name, call in {"+": lambda: x + other, "-": lambda: x - other, "*": lambda: x * other,
                       "/": lambda: x / other, "**": lambda: x ** other}.items():
        with pytest.raises(TypeError, match=rf"^\[{re.escape(name)}\] must be a value of float64 or a number, {got}"):
            call()
    with pytest.raises(TypeError):
        other + x
    with pytest.raises(TypeError, match=r"^\[@\] must be a value of float64, got"):
        x @ other


def test_numbers_of_numpy_are_numbers(tape):
    x = tape.constant(np.full(3, 3.0))
    for y in (x + np.float32(1), np.float64(1) + x, 7 - x, x * np.int64(2) - 2, 12 / x, x ** 2 - np.float64(5)):
        np.testing.assert_array_equal(y.numpy(), 4)


def test_gradcheck_wants_a_value():
    with pytest.raises(TypeError, match=r"\[gradcheck\] f must return a value of float64, got float"):
        engine.gradcheck(lambda x: 1.0, [np.ones(3)])


def test_none_is_refused_where_an_object_is_needed(tape, x):
    model, file = engine.Parameters("float64"), engine.SafetensorsFile()
    of = fm._fieldmark
    for call in (lambda: of.embed(None, fm.Key.random(), 4, 1, 1, None, 8, 0, None),
                 lambda: of.Adam_float64(None), lambda: of.Sgd_float64(None), lambda: of.Muon_float64(None, ["w"]),
                 lambda: of.Dense_float64(None, "d", 1, 1, False, 0),
                 lambda: of.Conv2d_float64(None, "c", 1, 1, 3, False, 0),
                 lambda: of.BatchNorm_float64(None, "b", 1, 1e-5, False),
                 lambda: of.GroupNorm_float64(None, "g", 1, 1, 1e-5, False),
                 lambda: of.Inspector_float64(None, False), lambda: model.leaf(None, "w"),
                 lambda: of.Parameters_float64.values(None, "w"), lambda: of.Tape_float64.constant(None, np.ones(3)),
                 lambda: engine.save_state(file, "", None), lambda: engine.load_state(file, "", None),
                 lambda: engine.save_state(None, "", model), lambda: tape.name(None, "x"), lambda: engine.exp(None),
                 lambda: engine.concatenate([x, None])):
        with pytest.raises(TypeError):
            call()


def test_an_op_names_the_argument_that_does_not_fit(x):
    array, other = np.ones(3), engine.Tape().constant(np.ones((4, 6), "float32"))
    for call, text in {
        lambda: engine.relu(array): r"[relu] x must be a value, got ndarray: pass it as tape.constant(x)",
        lambda: engine.maximum(x, b=array): r"[maximum] b must be a value, got ndarray: pass it as tape.constant(x)",
        lambda: engine.maximum(x, 0.5): r"[maximum] b must be a value, got float: pass it as tape.constant(numpy.full",
        lambda: engine.minimum(x, other): r"[minimum] b must be a value of float64, as a is, got one of float32",
        lambda: engine.concatenate([x, other]): r"[concatenate] xs[1] must be a value of float64, as xs[0] is",
        lambda: engine.concatenate(x): r"[concatenate] xs must be a list of values, got Value_float64",
        lambda: engine.mse_loss(x, None): r"[mse_loss] b must be a value, got NoneType",
        lambda: engine.softmax(x, "rows"): r"[softmax] axis must be an integer, got str",
        lambda: engine.reshape(x, 24): r"[reshape] shape must be a sequence of integers, got int",
        lambda: engine.affine(x, engine.sum(x), 0): r"[affine] factor must be a number, got Value_float64",
        lambda: engine.clamp(x, low=0, high="1"): r"[clamp] high must be a number, got str",
        lambda: engine.upsample_to(x, 2, 2, 3): r"[upsample_to] mode must be text, got int",
        lambda: engine.batch_norm(x, x, x, statistics=3): r"[batch_norm] statistics must be BatchStatistics(), got int",
        lambda: engine.relu(): r"[relu] needs x",
        lambda: engine.relu(y=x): r"[relu] has no argument y",
        lambda: engine.relu(x, x=x): r"[relu] got x twice",
        lambda: engine.relu(x, x): r"[relu] takes 1 arguments at most, got 2",
        lambda: engine.save_state(3, "", None): r"[save_state] file must be SafetensorsFile(), got int",
    }.items():
        with pytest.raises(TypeError, match="^" + re.escape(text)):
            call()


def test_layers_and_tapes_name_an_argument_that_is_no_value(tape):
    model = engine.Parameters("float64")
    layer, norm = engine.Dense(model, "d", 3, 2, seed=1), engine.BatchNorm(model, "n", 3)
    for call, name in ((lambda: layer(np.ones((2, 3))), "Dense: x"), (lambda: norm(np.ones((2, 3))), "BatchNorm: x"),
                       (lambda: norm.evaluate(np.ones((2, 3))), "BatchNorm: x"),
                       (lambda: tape.keep_grad(np.ones(3)), "Tape.keep_grad: value")):
        with pytest.raises(TypeError, match=rf"^\[{name}\] must be a value of float64, got ndarray: pass it as tape"):
            call()
    with pytest.raises(TypeError, match=r"^\[Parameters.leaf\] tape must be Tape\(\) of float64, got Tape_float32"):
        model.leaf(engine.Tape(), "d/weight")


def test_a_method_or_constructor_names_the_argument_that_does_not_fit(tape, x):
    model, array = engine.Parameters("float64"), np.ones((2, 3))
    layer, adam, file = engine.Dense(model, "d", 3, 2, seed=1), engine.Adam(model), engine.SafetensorsFile()
    camera = fm.Camera(np.eye(4)[:3], 0.7, 8, 8)
    for call, text in {
        lambda: model.add(3, array): "[Parameters.add] name must be text, got int",
        lambda: model.add("w"): "[Parameters.add] needs values",
        lambda: model.add("w", array, roles="matrix"): "[Parameters.add] has no argument roles",
        lambda: model.clip_grad_norm("1"): "[Parameters.clip_grad_norm] limit must be a number, got str",
        lambda: model.names(1): "[Parameters.names] takes 0 arguments at most, got 1",
        lambda: model.values(3, "w"): "[Parameters.values] takes 1 arguments at most, got 2",
        lambda: engine.Adam(model, lr="fast"): "[Adam] lr must be a number, got str",
        lambda: engine.Sgd(model, lr=0.1, nesterov=1): "[Sgd] nesterov must be True or False, got int",
        lambda: adam.step(None): "[Adam.step] lr_factor must be a number, got NoneType",
        lambda: engine.Dense(model, "e", 2.5, 2, seed=1): "[Dense] inputs must be an integer, got float",
        lambda: layer(): "[Dense] needs x",
        lambda: tape.reset(1): "[Tape.reset] takes 0 arguments at most, got 1",
        lambda: file.write(3): "[SafetensorsFile.write] path must be a path, got int",
        lambda: engine.SafetensorsFile(3): "[SafetensorsFile] takes 0 arguments at most, got 1",
        lambda: engine.SafetensorsFile.read(3): "[SafetensorsFile.read] path must be a path, got int",
        lambda: fm.Key.load(3): "[Key.load] path must be a path, got int",
        lambda: engine.relu(x, 2, 3): "[relu] takes 1 arguments at most, got 3",
        lambda: engine.sum(x, 0, 1): "[sum] keepdims must be True or False, got int",
        lambda: type(camera)(np.eye(4)[:3], 0.7, "8", 8): "[Camera] width must be an integer, got str",
        lambda: engine.cosine_decay("1", 10): "[cosine_decay] n must be an integer, got str",
        lambda: fm.set_threads("2"): "[set_threads] count must be an integer, got str",
    }.items():
        with pytest.raises(TypeError, match="^" + re.escape(text)):
            call()
    assert model.names() == ["d/weight", "d/bias"]


def test_gradcheck_refuses_what_would_always_pass():
    for inputs, rtol, text in (([], 1e-7, "inputs must not be empty"), ([np.ones(2)], 0.0, "rtol must be above 0"),
                               ([np.ones(2)], float("nan"), "rtol must be above 0")):
        with pytest.raises(ValueError, match=rf"^\[gradcheck\] {text}"):
            engine.gradcheck(engine.sum, inputs, rtol=rtol)


def test_layers_name_their_own_arguments():
    model = engine.Parameters()
    for call, text in ((lambda: engine.Dense(model, "a", 0, 1, seed=1),
                        r"\[Dense\] inputs must be 1 to 2147483647, got 0"),
                       (lambda: engine.Dense(model, "a", 1, -1, seed=1), r"\[Dense\] outputs must be 1 to 2147483647"),
                       (lambda: engine.Conv2d(model, "a", 0, 1, seed=1), r"\[Conv2d\] inputs must be 1 to 2147483647"),
                       (lambda: engine.Conv2d(model, "a", 1, 1, seed=1, kernel=2), r"\[Conv2d\] kernel must be odd")):
        with pytest.raises(ValueError, match="^" + text):
            call()
    assert model.names() == []


def test_an_array_that_is_refused_is_not_kept(tape):
    array = np.ones((1,) * 6)
    with pytest.raises(fm.ShapeError, match="at most 5 axes"):
        tape.constant(array)
    array[:] = 2


def test_a_layer_that_refuses_its_input_leaves_the_parameters_free(tape):
    model = engine.Parameters("float64")
    layer = engine.Dense(model, "d", 3, 2, seed=1)
    with pytest.raises(fm.ShapeError):
        layer(tape.constant(np.ones((4, 5))))
    engine.Dense(model, "more", 2, 1, seed=2)
    loss = engine.sum(layer(tape.constant(np.ones((4, 3)))))
    with pytest.raises(BufferError):
        engine.Dense(model, "too late", 2, 1, seed=2)
    with pytest.raises(fm.ShapeError):
        layer(tape.constant(np.ones((4, 5))))
    loss.backward()
    np.testing.assert_array_equal(model.grads("d/bias"), [4, 4])
    with pytest.raises(BufferError):
        engine.Dense(model, "still too late", 2, 1, seed=2)


def test_a_value_is_no_truth_number_or_array_in_silence(tape):
    x = tape.leaf(np.array([1.0, 2.0]))
    for call, text in {lambda: bool(x): r"\[bool\].*value.item\(\)", lambda: x == x: r"\[==\].*engine.equal",
                       lambda: x != 1: r"\[!=\].*engine.equal", lambda: np.asarray(x): r"\[numpy\].*value.numpy\(\)",
                       lambda: np.sum([x, x]): r"\[numpy\].*value.numpy\(\)"}.items():
        with pytest.raises(TypeError, match="^" + text):
            call()
    assert {x: 1}[x] == 1
    with pytest.raises(fm.ShapeError, match=r"^\[item\]"):
        float(x)
    assert float(engine.sum(x)) == 3


def test_numbers_that_float32_cannot_hold_are_refused():
    x = engine.Tape().constant(np.ones(3, "float32"))
    with pytest.raises(ValueError, match=r"^\[\+\] must be a number within the range of float32, got 1e\+300"):
        x + 1e300
    assert np.isinf((x * float("inf")).numpy()).all()
    assert (engine.Tape("float64").constant(np.ones(3)) * 1e300).numpy()[0] == 1e300


def test_an_exception_of_a_number_is_passed_on(x):
    class Number:
        def __float__(self):
            raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        x + Number()
    with pytest.raises(OverflowError):
        x + 10 ** 400


def test_errors_of_the_module_have_one_base(tape):
    for error, base in ((fm.ValueError_, ValueError), (fm.ShapeError, ValueError), (fm.IoError, OSError)):
        assert issubclass(error, fm.Error) and issubclass(error, base)
    with pytest.raises(fm.Error):
        tape.leaf(np.ones((4, 6))[:, ::2])
    with pytest.raises(fm.Error, match="nowhere"):
        fm.Field.load("/nowhere")


def test_parameters_are_known_by_name():
    model = engine.Parameters("float64")
    model.add("w", np.ones(3))
    with pytest.raises(ValueError, match="v"):
        model.values("v")
    with pytest.raises(ValueError, match="limit"):
        model.clip_grad_norm(0)
    model.grads("w")[:] = [3, 4, 0]
    assert model.grad_norm() == model.clip_grad_norm(1) == 5
    model.grads("w")[1] = np.nan
    with pytest.raises(ValueError, match="w"):
        model.clip_grad_norm(1)
    with pytest.raises(TypeError, match=r"\[Adam\] parameters must be Parameters\(\), got list"):
        engine.Adam([])
