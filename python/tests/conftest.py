import numpy as np
import pytest

import fieldmark as fm
from ball import write_ball
from fieldmark import engine


@pytest.fixture(scope="session")
def scene(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ball")
    write_ball(folder)
    return folder


@pytest.fixture(scope="session")
def field(scene):
    return fm.train(scene, steps=150)


@pytest.fixture(scope="session")
def owner(field):
    return fm.embed(field, fm.Key.random(), bits=16, steps=20, views=8)


@pytest.fixture(scope="session")
def marked(owner):
    return fm.bake(owner, "a5c3", steps=10)


@pytest.fixture
def tape():
    return engine.Tape("float64")


@pytest.fixture
def x(tape):
    return tape.leaf(np.random.default_rng(0).standard_normal((4, 6)))
