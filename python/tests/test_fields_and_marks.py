"""A small job from a data set to the verdict, and the same bytes as the command's own formats."""

import json
import re
import shutil
import struct
import threading
import time
import warnings
from pathlib import Path

import numpy as np
import pytest

import fieldmark as fm
from ball import SIZE, look_at, write_ball, write_png

VERSION_0_1 = Path(__file__).resolve().parents[2] / "tests" / "regression" / "version_0_1"


def test_a_field_learns_its_scene(scene, field):
    assert field.evaluate(scene)["psnr"] > 18


def features(path):
    """The features of a field's table, from its safetensors file."""
    content = path.read_bytes()
    length, = struct.unpack("<Q", content[:8])
    begin, end = json.loads(content[8:8 + length])["hash/density_features"]["data_offsets"]
    return np.frombuffer(content[8 + length + begin:8 + length + end], "float32")


def test_equal_seeds_give_equal_fields_and_others_other_ones(scene, tmp_path):
    for name, seed in (("a", 3), ("b", 3), ("c", 4)):
        fm.train(scene, steps=1, seed=seed).save(tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    a, c = (features(tmp_path / name) for name in ("a", "c"))
    assert (a != c).mean() > 0.99  # the initial ones too, of which one step changes four fifths


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


def test_the_mark_psnr_suits_the_scene_unless_given(owner):
    assert 36.5 < owner.mark_psnr <= 40
    small = fm.Field.load(VERSION_0_1 / "field.fm")  # whose views take a tenth of the time of a default field's
    given = fm.embed(small, fm.Key.random(), bits=4, steps=1, views=8, mark_psnr=33)
    assert given.mark_psnr == 33
    with pytest.raises(ValueError, match="mark_psnr must be 20 to 60 dB"):
        fm.embed(small, fm.Key.random(), bits=4, steps=1, views=8, mark_psnr=0)


def test_a_marked_field_is_read_and_its_evidence_bounded(owner, marked, tmp_path):
    images = [marked.render(camera) for camera in marked.cameras(2, size=32)]
    read = owner.extract(images, detection="blind")
    assert len(read["message"]) == 4 and len(read["logits"]) == len(read["bit_p_values"]) == len(read["bits"]) == 16
    assert 0 < read["p_noise"] <= 1 and read["read"] == (read["p_noise"] <= read["fpr"])
    assert read["detection"] == "blind" and [v["detection"] for v in read["views"]] == ["blind"] * 2
    assert len(read["views"][0]["logits"]) == 16
    verdict = owner.verify("a5c3", images, detection="blind")
    one, two = verdict["p_value"], verdict["p_value_two_sided"]
    assert 0 < one <= 1 and 0 < two <= 1 and verdict["bits"] == 16
    assert one == 1 or two == pytest.approx(min(1, 2 * one))  # the key is random, so its statistic may be negative
    assert 0 < verdict["p_value_bits"] <= 1 and 0 < verdict["p_value_bits_two_sided"] <= 1
    assert verdict["p_noise"] == read["p_noise"] and verdict["detection"] == "blind" and verdict["views"] == 2
    assert 0 <= verdict["contradicting_bits"] <= 16 - verdict["matching_bits"]
    assert len(verdict["per_view"]) == 2 and len(verdict["per_view"][0]["bit_p_values"]) == 16
    assert verdict["found"] == (verdict["p_value"] <= 1e-6) and owner.verify("a5c3", images, "blind", fpr=1)["found"]
    owner.save(tmp_path / "owner.fm")
    assert fm.Owner.load(tmp_path / "owner.fm").extract(images, detection="blind") == read


def test_an_owner_of_version_0_1_is_not_free_of_its_key(owner):
    assert owner.key_free is True
    assert fm.Owner.load(VERSION_0_1 / "owner.fm").key_free is False


def test_errors_name_what_is_wrong(scene, field, owner, tmp_path):
    with pytest.raises(OSError, match="nowhere"):
        fm.train(tmp_path / "nowhere", steps=1)
    with pytest.raises(fm.IoError, match="nowhere"):
        fm.Field.load(tmp_path / "nowhere")
    with pytest.raises(ValueError, match="seconds or steps, not both"):
        fm.train(scene, steps=1, seconds=1)
    with pytest.raises(ValueError, match=r"^\[train\] steps must be 1 to 2147483647, got 0"):
        fm.train(scene, steps=0)
    key = fm.Key.random()
    for call, text in ((lambda: fm.train(scene, seconds="60"), "[train] seconds must be a number, got str"),
                       (lambda: fm.train(scene, steps=10.5), "[train] steps must be an integer, got float"),
                       (lambda: fm.train(scene, steps=1, progress=3), "[train] progress must be a function, got int"),
                       (lambda: fm.train(3, steps=1), "[train] data must be a path, got int"),
                       (lambda: fm.embed(field, key, mark_psnr="36"), "[embed] mark_psnr must be a number, got str"),
                       (lambda: fm.embed(field, key, seconds=None, progress=1), "[embed] progress must be a function"),
                       (lambda: fm.bake(owner, "a", seconds=True), "[bake] seconds must be a number, got bool")):
        with pytest.raises(TypeError, match="^" + re.escape(text)):
            call()
    with pytest.raises(ValueError):
        fm.bake(owner, "aa", steps=1)
    with pytest.raises(fm.ShapeError, match="camera to world"):
        fm.Camera(np.eye(2), 0.7, 10, 10)


def test_results_have_the_keys_of_the_command(owner):
    """Those of docs/json.md, but for times and what needs files, controls or a second key."""
    text = (Path(__file__).resolve().parents[2] / "docs" / "json.md").read_text()

    def keys(command):
        section = re.search(rf"^## {command}$(.*?)^## ", text, re.MULTILINE | re.DOTALL).group(1)
        return {key for line in section.splitlines() if line.startswith("| `")
                for key in re.findall(r"`(\w+)`", line.split("|")[1])}

    image = np.random.default_rng(0).random((16, 16, 3), dtype="float32")
    assert set(owner.extract(image, "blind")) == keys("extract") - {"seconds_per_image"}
    assert set(owner.verify("a5c3", image, "blind")) == keys("verify") - {
        "owner_sha256", "commitment", "copy", "controls", "seconds_per_image", "wrong_keys"}


def test_images_are_checked_before_any_is_read(owner):
    good = np.zeros((16, 16, 3), "float32")
    with pytest.raises(ValueError, match=r"^\[extract\] images must not be empty"):
        owner.extract([])
    with pytest.raises(TypeError, match=r"^\[extract: images\[1\]\] must be of float32, got uint8"):
        owner.extract([good, good.astype("uint8")])
    with pytest.raises(TypeError, match=r"^\[verify\] images must be a list of arrays \[height, width, 3\], got int"):
        owner.verify("a5c3", 3)
    for bad in (good[0], good[..., :1], good[:8], good[None]):
        with pytest.raises(fm.ShapeError, match=r"^\[extract: images\[2\]\] must be \[height, width, 3\] with sides of"):
            owner.extract([good, good, np.ascontiguousarray(bad)])
    for value in (255, -0.5, np.nan):
        with pytest.raises(ValueError, match=r"^\[verify: images\[1\]\] must be in \[0, 1\] \(divide 8-bit values by 255\), "
                                             "got"):
            owner.verify("a5c3", [good, np.full((16, 16, 3), value, "float32")])
    with pytest.raises(ValueError, match="detection must be auto, blind or informed, got 'seen'"):
        owner.extract([good], detection="seen")
    for fpr in (0, 2, np.nan):
        with pytest.raises(ValueError, match=r"fpr must be in \(0, 1\], got"):
            owner.extract([good], fpr=fpr)


def test_one_image_a_list_and_a_generator_are_read_alike(owner):
    image = np.random.default_rng(1).random((16, 20, 3), dtype="float32")
    one = owner.extract(image, "blind")
    assert one == owner.extract([image], "blind") == owner.extract(image[None], "blind")
    assert one == owner.extract((i for i in [image]), "blind")


def test_cameras_are_checked():
    pose = look_at(np.array([0.0, 4.0, 1.0]))
    assert fm.Camera(np.vstack([pose, [0, 0, 0, 1]]), 0.7, 4, 3).height == 3
    with pytest.raises(ValueError, match=r"^\[Camera\] pose must be finite"):
        fm.Camera(pose * np.nan, 0.7, 4, 3)
    with pytest.raises(ValueError, match=r"^\[Camera\] pose must end with the row 0, 0, 0, 1, got"):
        fm.Camera(np.ones((4, 4)), 0.7, 4, 3)
    for fov in (0, 4, np.nan):
        with pytest.raises(ValueError, match=r"^\[Camera\] fov must be in \(0, pi\) radians"):
            fm.Camera(pose, fov, 4, 3)
    with pytest.raises(ValueError, match=r"^\[Camera\] width must be 1 to 65536, got 0"):
        fm.Camera(pose, 0.7, 0, 3)


def test_options_are_checked_before_the_work(scene, field, owner):
    key = fm.Key.random()
    for wrong in ({"bits": 0}, {"bits": 257}, {"views": 7}, {"mark_psnr": 61}, {"mark_psnr": np.nan}, {"seed": -1}):
        with pytest.raises(fm.Error, match=rf"^\[embed\] {list(wrong)[0]} must be"):
            fm.embed(field, key, seconds=1e6, **wrong)
    with pytest.raises(TypeError, match=r"^\[embed\] bits must be an integer, got float"):
        fm.embed(field, key, bits=1.5)
    with pytest.raises(TypeError, match=r"^\[embed\] field must be Field, got NoneType"):
        fm.embed(None, key)
    with pytest.raises(TypeError, match=r"^\[bake\] owner must be Owner, got NoneType"):
        fm.bake(None, "a")
    with pytest.raises(TypeError, match=r"^\[bake\] message must be str, got int"):
        fm.bake(owner, 10)
    with pytest.raises(ValueError, match=r"^\[train\] seed must be 0 to"):
        fm.train(scene, seed=-1)


def test_a_collapsed_training_raises(tmp_path):
    folder = tmp_path / "nothing"
    write_ball(folder)
    for image in folder.glob("*/*.png"):
        write_png(image, np.zeros((SIZE, SIZE, 4)))
    with pytest.raises(fm.Error, match=r"^\[train\] training collapsed after \d+ steps: .*taken for type"):
        fm.train(folder, steps=500)


def test_remarks_on_a_data_set_are_warnings(scene, tmp_path):
    folder = tmp_path / "held_out"
    shutil.copytree(scene, folder)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fm.train(folder, steps=1)
    (folder / "transforms_train.json").rename(folder / "transforms.json")
    (folder / "transforms_test.json").unlink()
    with pytest.warns(UserWarning, match="held out for val and test") as told:
        fm.train(folder, steps=1)
    assert told[0].filename == __file__


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


def test_an_owner_takes_another_key(owner, tmp_path):
    key, before = fm.Key.random(), owner.key
    other = owner.with_key(key)
    assert other.key == key and owner.key == before != key
    other.with_key(before).save(tmp_path / "again.fm")
    owner.save(tmp_path / "owner.fm")
    assert (tmp_path / "again.fm").read_bytes() == (tmp_path / "owner.fm").read_bytes()
    with pytest.raises(TypeError):
        owner.with_key(None)


def test_a_key_is_kept_and_not_shown(tmp_path):
    key = fm.Key.random()
    key.save(tmp_path / "key")
    assert fm.Key.load(tmp_path / "key") == key and key != fm.Key.random()
    assert key != None and not key == "key"  # noqa: E711: what is compared is the operator
    assert (tmp_path / "key").stat().st_mode & 0o077 == 0
    assert repr(key) == "<fieldmark key, secret>"
