"""A data set for tests: a ball before nothing, drawn by tracing rays."""

import json
import math
import struct
import zlib

import numpy as np

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
    pixels = (np.clip(image, 0, 1) * 255 + 0.5).astype("uint8")
    height, width, channels = pixels.shape

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    path.write_bytes(b"\x89PNG\r\n\x1a\n"
                     + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, {3: 2, 4: 6}[channels], 0, 0, 0))
                     + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
