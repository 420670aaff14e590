"""Fits a pattern with a small network: colour as a function of position, as examples/fit_image.cpp does.

    python3 fit_image.py [STEPS]
"""

import sys
import time

import numpy as np

from fieldmark import engine

BANDS, STEPS = 5, int(sys.argv[1]) if len(sys.argv) > 1 else 400

y, x = np.meshgrid(np.arange(48) / 48, np.arange(64) / 64, indexing="ij")
image = np.stack([0.5 + 0.5 * np.sin(6 * x + 9 * y * y + 2 * c) for c in range(3)], -1)
image = image.reshape(-1, 3).astype("float32")
place = np.stack([x.ravel(), y.ravel()], -1)
waves = [f(2 ** k * np.pi * place) for k in range(BANDS) for f in (np.sin, np.cos)]
encoded = np.concatenate(waves, -1).astype("float32")

model = engine.Parameters()
first = engine.Dense(model, "first", 4 * BANDS, 48, relu=True, seed=1)
second = engine.Dense(model, "second", 48, 48, relu=True, seed=2)
last = engine.Dense(model, "last", 48, 3, seed=3)
adam, tape = engine.Adam(model, lr=5e-3, beta2=0.99), engine.Tape()

begun = time.perf_counter()
for step in range(STEPS):
    tape.reset()
    model.zero_grad()
    colour = engine.sigmoid(last(second(first(tape.constant(encoded)))))
    loss = engine.mse_loss(colour, tape.constant(image))
    loss.backward()
    adam.step(engine.cosine_decay(step, STEPS))
seconds = time.perf_counter() - begun
print(f"PSNR {-10 * np.log10(loss.item()):.1f} dB, {1e3 * seconds / STEPS:.3f} ms a step")
