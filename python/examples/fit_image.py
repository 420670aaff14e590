"""Fits a pattern with a small network: colour as a function of position, as examples/fit_image.cpp does."""

import time

import numpy as np

from fieldmark import engine

BANDS, STEPS = 5, 400

y, x = np.meshgrid(np.arange(48) / 48, np.arange(64) / 64, indexing="ij")
image = np.stack([0.5 + 0.5 * np.sin(6 * x + 9 * y * y + 2 * c) for c in range(3)], -1)
image = image.reshape(-1, 3).astype("float32")
place = np.stack([x.ravel(), y.ravel()], -1)
waves = np.concatenate([2 ** k * np.pi * place for k in range(BANDS)], -1)
encoded = np.concatenate([np.sin(waves), np.cos(waves)], -1).astype("float32")

model, rng = engine.Parameters(), np.random.default_rng(1)
for name, rows, columns in [("first", 4 * BANDS, 48), ("second", 48, 48), ("last", 48, 3)]:
    bound = np.sqrt(6 / rows)
    model.add(name + "/weight", rng.uniform(-bound, bound, (rows, columns)).astype("float32"))
    model.add(name + "/bias", np.zeros(columns, "float32"))
adam, tape = engine.Adam(model, lr=5e-3, beta2=0.99), engine.Tape()

begun = time.perf_counter()
for step in range(STEPS):
    h = tape.constant(encoded)
    for name in ("first", "second", "last"):
        h = engine.dense(h, model.leaf(tape, name + "/weight"), model.leaf(tape, name + "/bias"),
                         relu=name != "last")
    loss = engine.mse_loss(engine.sigmoid(h), tape.constant(image))
    loss.backward()
    last = loss.item()
    adam.step(0.1 ** max(0, step / STEPS - 0.1))
    model.zero_grad()
    tape.reset()
print(f"PSNR {-10 * np.log10(last):.1f} dB, {1e3 * (time.perf_counter() - begun) / STEPS:.3f} ms a step")
