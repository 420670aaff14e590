"""A small job from a data set to the verdict, and the same bytes as the command's own formats."""

import json
import math

import numpy as np
import pytest

import fieldmark as fm

SIZE, VIEWS = 24, 12


def look_at(eye):
    back = eye / np.linalg.norm(eye)
    right = np.cross([0, 0, 1], back)
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(back, right), back, eye])


def write_ball(folder):
    """A red and green ball before nothing, drawn by tracing rays."""
    fov = 0.7
    for split in ("train", "test"):
        frames = []
        (folder / split).mkdir(parents=True)
        for i in range(VIEWS):
            angle = 2 * math.pi * (i + (split == "test") / 2) / VIEWS
            pose = look_at(4 * np.array([math.cos(angle), math.sin(angle), 0.5]) / math.sqrt(1.25))
            x, y = np.meshgrid(*[(np.arange(SIZE) + 0.5 - SIZE / 2) / (SIZE / 2 / math.tan(fov / 2))] * 2)
            d = np.stack([x, -y, -np.ones_like(x)], -1) @ pose[:, :3].T
            d /= np.linalg.norm(d, axis=-1, keepdims=True)
            b = d @ pose[:, 3]
            hit = b * b - (pose[:, 3] @ pose[:, 3] - 1)
            t = -b - np.sqrt(np.maximum(hit, 0))
            p = pose[:, 3] + t[..., None] * d
            image = np.concatenate([0.5 + 0.4 * np.sign(p[..., :1]), 0.5 + 0.3 * p[..., 1:2],
                                    np.full_like(t, 0.2)[..., None], (hit > 0)[..., None]], -1)
            write_png(folder / split / f"r_{i}.png", np.where(image[..., 3:] > 0, image, 0))
            frames.append({"file_path": f"./{split}/r_{i}",
                           "transform_matrix": np.vstack([pose, [0, 0, 0, 1]]).tolist()})
        (folder / f"transforms_{split}.json").write_text(json.dumps({"camera_angle_x": fov, "frames": frames}))


def write_png(path, image):
    import struct
    import zlib
    pixels = (np.clip(image, 0, 1) * 255 + 0.5).astype("uint8")
    height, width, channels = pixels.shape

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    path.write_bytes(b"\x89PNG\r\n\x1a\n"
                     + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, {3: 2, 4: 6}[channels], 0, 0, 0))
                     + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ball")
    write_ball(folder)
    return folder


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


def test_a_key_is_kept_and_not_shown(tmp_path):
    key = fm.Key.random()
    key.save(tmp_path / "key")
    assert fm.Key.load(tmp_path / "key") == key and key != fm.Key.random()
    assert (tmp_path / "key").stat().st_mode & 0o077 == 0
    assert repr(key) == "<fieldmark key, secret>"
