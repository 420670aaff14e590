"""A small job from a data set to the verdict, and the same bytes as the command's own formats."""

import threading
import time

import numpy as np
import pytest

import fieldmark as fm
from ball import look_at

@pytest.fixture(scope="module")
def field(scene):
    return fm.train(scene, steps=150)


@pytest.fixture(scope="module")
def owner(field, tmp_path_factory):
    return fm.embed(field, fm.Key.random(), bits=4, steps=20, views=8)


def test_a_field_learns_its_scene(scene, field):
    assert field.evaluate(scene)["psnr"] > 18


def test_equal_seeds_give_equal_fields(scene, tmp_path):
    for name in ("a", "b"):
        fm.train(scene, steps=5, seed=3).save(tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_a_file_gives_the_same_images(field, tmp_path):
    field.save(tmp_path / "field.fm")
    again = fm.Field.load(tmp_path / "field.fm")
    camera = fm.Camera(look_at(np.array([0.0, 4.0, 1.0])), 0.7, 20, 16)
    image = again.render(camera)
    assert image.shape == (16, 20, 3) and image.dtype == np.float32
    np.testing.assert_array_equal(image, field.render(camera))


def test_progress_is_told_and_may_stop_the_run(scene):
    told = []
    fm.train(scene, steps=50, progress=lambda steps, seconds: told.append((steps, seconds)))
    assert [steps for steps, _ in told] == [25, 50]

    def stop(steps, seconds):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        fm.train(scene, steps=50, progress=stop)


def test_the_mark_psnr_suits_the_scene_unless_given(field, owner):
    assert 36.5 < owner.mark_psnr <= 40
    given = fm.embed(field, fm.Key.random(), bits=4, steps=1, views=8, mark_psnr=33)
    assert given.mark_psnr == 33
    with pytest.raises(ValueError, match="mark_psnr must be 20 to 60 dB"):
        fm.embed(field, fm.Key.random(), bits=4, steps=1, views=8, mark_psnr=0)


def test_a_marked_field_is_read_and_its_evidence_bounded(owner, tmp_path):
    marked = fm.bake(owner, "a", steps=10)
    images = [marked.render(camera) for camera in marked.cameras(2, size=32)]
    read = owner.extract(images, detection="blind")
    assert len(read["message"]) == 1 and len(read["logits"]) == len(read["p_values"]) == 4
    assert 0 < read["p_noise"] <= 1
    verdict = owner.verify("a", images, detection="blind")
    assert 0 < verdict["p_value"] <= 1 and verdict["bits"] == 4
    owner.save(tmp_path / "owner.fm")
    assert fm.Owner.load(tmp_path / "owner.fm").extract(images, detection="blind") == read


def test_errors_name_what_is_wrong(scene, field, owner, tmp_path):
    with pytest.raises(OSError, match="nowhere"):
        fm.train(tmp_path / "nowhere", steps=1)
    with pytest.raises(fm.IoError, match="nowhere"):
        fm.Field.load(tmp_path / "nowhere")
    with pytest.raises(ValueError, match="seconds or steps, not both"):
        fm.train(scene, steps=1, seconds=1)
    with pytest.raises(ValueError, match="at least 1, got 0"):
        fm.train(scene, steps=0)
    with pytest.raises(ValueError):
        fm.bake(owner, "aa", steps=1)
    with pytest.raises(fm.ShapeError, match="camera to world"):
        fm.Camera(np.eye(2), 0.7, 10, 10)
    with pytest.raises(ValueError, match="images must not be empty"):
        owner.extract([])
    with pytest.raises(TypeError, match="must be of float32, got uint8"):
        owner.extract([np.zeros((8, 8, 3), "uint8")])
    with pytest.raises(ValueError, match="auto or blind, got 'seen'"):
        owner.extract([np.zeros((8, 8, 3), "float32")], detection="seen")


def test_pixels_outside_the_unit_interval_are_refused(owner):
    for image in (np.full((8, 8, 3), 255, "float32"), np.full((8, 8, 3), -0.5, "float32")):
        with pytest.raises(ValueError, match=r"in \[0, 1\] \(divide 8-bit values by 255\), got"):
            owner.verify("a", [image])


def test_the_ground_truth_is_composited_over_the_background_of_the_field(scene, field, tmp_path):
    field.save(tmp_path / "white.fm")
    bytes_of = (tmp_path / "white.fm").read_bytes()
    assert bytes_of.count(b'"background\\":\\"white') > 0
    (tmp_path / "black.fm").write_bytes(bytes_of.replace(b'"background\\":\\"white', b'"background\\":\\"black'))
    black = fm.Field.load(tmp_path / "black.fm")
    # Both see the same object; a truth over the other background would differ in half of the image.
    assert abs(black.evaluate(scene)["psnr"] - field.evaluate(scene)["psnr"]) < 3


def test_other_threads_go_on_while_a_field_trains(scene):
    stamps, done = [], threading.Event()

    def count():
        while not done.is_set():
            stamps.append(time.monotonic())
            time.sleep(0.001)

    beside = threading.Thread(target=count)
    beside.start()
    begin = time.monotonic()
    fm.train(scene, steps=24)      # fewer steps than between two calls of progress
    end = time.monotonic()
    done.set()
    beside.join()
    inside = [t for t in stamps if begin < t < end]
    assert inside and min(inside) - begin < (end - begin) / 2 < max(inside) - begin


def test_two_threads_use_one_field(field):
    camera = field.cameras(1, size=24)[0]
    expected, images = field.render(camera), {}

    def render(name):
        images[name] = field.render(camera)

    threads = [threading.Thread(target=render, args=(name,)) for name in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for name in range(4):
        np.testing.assert_array_equal(images[name], expected)


def test_a_key_is_kept_and_not_shown(tmp_path):
    key = fm.Key.random()
    key.save(tmp_path / "key")
    assert fm.Key.load(tmp_path / "key") == key and key != fm.Key.random()
    assert key != None and not key == "key"  # noqa: E711: what is compared is the operator
    assert (tmp_path / "key").stat().st_mode & 0o077 == 0
    assert repr(key) == "<fieldmark key, secret>"
