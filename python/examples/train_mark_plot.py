"""Trains a field on a data set, marks it, reads the message back and plots what the mark changes.

    fieldmark scene --out scene
    python3 train_mark_plot.py scene [STEPS]     # default: two and a half minutes of training
"""

import sys

import numpy as np

import fieldmark as fm

# %% Train a field and look at how well it shows what it was not trained on.
folder = sys.argv[1] if len(sys.argv) > 1 else "scene"


def length(seconds):
    return {"steps": int(sys.argv[2])} if len(sys.argv) > 2 else {"seconds": seconds}


field = fm.train(folder, **length(30), progress=lambda steps, seconds: print(f"\r{seconds:.0f} s", end=""))
print("\ntest views:", field.evaluate(folder))

# %% Teach a mark, then write a message into a copy to publish.
owner = fm.embed(field, fm.Key.random(), bits=16, **length(90))
marked = fm.bake(owner, "a5c3", **length(30))

# %% Read it from images.
cameras = field.cameras(10, seed=1)
clean, shown = [field.render(c) for c in cameras], [marked.render(c) for c in cameras]
print("read:", owner.extract(shown)["message"])
print("p-value, marked:", owner.verify("a5c3", shown)["p_value"])
print("p-value, unmarked:", owner.verify("a5c3", clean)["p_value"])
error = np.mean([np.mean((a - b) ** 2) for a, b in zip(clean, shown)])
print(f"PSNR of marked to unmarked renders: {-10 * np.log10(error):.1f} dB")

# %% Plot.
try:
    import matplotlib.pyplot as plt
except ImportError:
    print("no plot: python3-matplotlib is missing")
else:
    figure, axes = plt.subplots(1, 3, figsize=(12, 4))
    for axis, image, title in zip(axes, [clean[0], shown[0], np.abs(shown[0] - clean[0]) * 10],
                                  ["unmarked", "marked", "ten times the difference"]):
        axis.imshow(np.clip(image, 0, 1))
        axis.set_title(title)
        axis.axis("off")
    figure.savefig("mark.png")
