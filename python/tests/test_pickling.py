"""What can be pickled and copied, and what the others say instead."""

import copy
import inspect
import pickle

import numpy as np
import pytest

import fieldmark as fm
from fieldmark import _fieldmark, engine

CAN = {"Parameters_float32", "Parameters_float64"}
CLASSES = {name: kind for name, kind in vars(_fieldmark).items()
           if inspect.isclass(kind) and not issubclass(kind, Exception)}


def model(dtype="float32"):
    made = engine.Parameters(dtype)
    layer = engine.Dense(made, "d", 3, 2, seed=1)
    made.add("mean", np.arange(4, dtype=dtype), role="running")
    made.grads("d/bias")[:] = 1
    return made, layer


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("way", [lambda p: pickle.loads(pickle.dumps(p)), copy.deepcopy, copy.copy])
def test_parameters_keep_names_values_and_roles(dtype, way):
    made, _ = model(dtype)
    again = way(made)
    assert type(again) is type(made) and again.names() == made.names() == ["d/weight", "d/bias", "mean"]
    for name in made.names():
        assert again.role(name) == made.role(name) and again.values(name).dtype == dtype
        np.testing.assert_array_equal(again.values(name), made.values(name))
        assert not again.grads(name).any()
    again.values("mean")[:] = 7
    np.testing.assert_array_equal(made.values("mean"), np.arange(4))


def test_a_copy_can_be_trained_and_have_more_parameters():
    made, _ = model("float64")
    adam = engine.Adam(made)  # refers to the original alone
    again = copy.deepcopy(made)
    again.add("more", np.ones(2))
    again.grads("more")[:] = 1
    engine.Adam(again, lr=0.5).step()
    np.testing.assert_allclose(again.values("more"), 0.5, rtol=1e-6)
    assert made.names() == ["d/weight", "d/bias", "mean"] and adam.steps == 0


def test_parameters_without_tensors_are_copied():
    assert copy.deepcopy(engine.Parameters()).names() == []


def test_a_state_that_is_none_is_refused():
    made = engine.Parameters()
    for state in (([("w", np.ones(2), "trained")],), ([("w", np.ones(2, "float32"), "frozen")],)):
        with pytest.raises((TypeError, ValueError), match=r"^\[Parameters.add"):
            type(made).__new__(type(made)).__setstate__(state)


def objects():
    """An object of each class that a user can make without a field."""
    made, layer = model()
    tape = engine.Tape()
    return {"Key": fm.Key.random(), "Camera": fm.Camera(np.eye(4), 0.7, 8, 8), "Adam": engine.Adam(made),
            "Sgd": engine.Sgd(made), "Muon": engine.Muon(made, ["d/weight"]), "Dense": layer, "Tape": tape,
            "Value": tape.constant(np.ones(2, "float32")), "SafetensorsFile": engine.SafetensorsFile(),
            "Schedule": engine.Schedule(steps=3), "AdamGroup": engine.AdamGroup("*"),
            "GradcheckReport": engine.gradcheck(engine.square, [np.ones(2)]),
            "Inspector": engine.Inspector(tape)}


@pytest.mark.parametrize("way", [pickle.dumps, copy.copy, copy.deepcopy, lambda x: pickle.dumps(x, 0)])
def test_other_objects_say_what_to_use_instead(way):
    words = {"Key": r"save\(path\)", "Adam": r"save_state\(\)", "Dense": r"save_state\(\)", "Value": r"value.numpy\(\)",
             "SafetensorsFile": r"write\(path\)", "Schedule": "keep its numbers", "Tape": "make it anew"}
    for kind, thing in objects().items():
        with pytest.raises(TypeError, match=rf"^\[{kind}\] cannot be pickled or copied: .*{words.get(kind, '')}"):
            way(thing)


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_every_class_can_be_pickled_or_says_why_not(name):
    if name in CAN:
        assert "__getstate__" in vars(CLASSES[name])
        return
    kind = name.partition("_float")[0]
    advice = {"Owner": r"save\(path\), and load\(path\) of its class", "Field": r"save\(path\), and load\(path\)"}
    with pytest.raises(TypeError, match=rf"^\[{kind}\] cannot be pickled or copied: .*{advice.get(kind, '')}"):
        CLASSES[name].__reduce__(CLASSES[name].__new__(CLASSES[name]))
