"""Ten steps of models and optimisers in PyTorch, in double.

python3 torch_training.py FILE: FILE is a safetensors file. Its metadata `runs` lists runs: the name, the model, the names of its
parameters, the optimiser with its options, and the losses that Fieldmark found before each step; tensors NAME/PARAMETER hold
where it began, NAME/x and NAME/target its data. Prints a line for each run: its name and the worst relative error of the losses.
"""
import json
import sys

import torch
import torch.nn.functional as F

from safetensors_file import read_safetensors

torch.set_num_threads(1)  # small tensors: threads would only wait for each other


def dense(p, name, x):
    return x @ p[name + "/weight"] + p[name + "/bias"]


def dense_loss(run, p, data):
    h = torch.relu(dense(p, "a", data("x")))
    return F.mse_loss(dense(p, "c", torch.relu(dense(p, "b", h))), data("target"))


def convolve(p, name, x):
    return F.conv2d(x, p[name + "/weight"].permute(3, 2, 0, 1), p[name + "/bias"], padding=1)


def convolutional_loss(run, p, data):
    h = convolve(p, "first", data("x").permute(0, 3, 1, 2))
    h = F.batch_norm(h, None, None, p["batch/gamma"], p["batch/beta"], training=True)
    h = convolve(p, "second", F.max_pool2d(torch.relu(h), 2))
    h = F.group_norm(h, 4, p["group/gamma"], p["group/beta"])
    h = F.avg_pool2d(torch.relu(h), 2).permute(0, 2, 3, 1).reshape(len(run["labels"]), -1)
    return F.cross_entropy(dense(p, "out", h), torch.tensor(run["labels"]))


def transformer_loss(run, p, data):
    embedded = p["letter"][torch.tensor(run["seen"])] + p["place"]
    n, width = embedded.shape
    q, k, v = (part.reshape(n, run["heads"], -1).transpose(0, 1) for part in dense(p, "qkv", embedded).chunk(3, 1))
    scores = q @ k.transpose(1, 2) / q.shape[-1] ** 0.5
    scores = scores.masked_fill(torch.ones(n, n, dtype=torch.bool).triu(1), float("-inf"))
    x = embedded + dense(p, "mix", (scores.softmax(-1) @ v).transpose(0, 1).reshape(n, width))
    h = F.layer_norm(x, (width,), p["gamma"], p["beta"])
    logits = dense(p, "out", x + dense(p, "narrow", F.gelu(dense(p, "wide", h))))
    return F.cross_entropy(logits, torch.tensor(run["next"]))


LOSSES = {"dense": dense_loss, "convolutional": convolutional_loss, "transformer": transformer_loss}


def train(run, tensors):
    parameters = {name: tensors[f"{run['name']}/{name}"].clone().requires_grad_() for name in run["parameters"]}
    options = run["options"]
    if "betas" in options:
        options["betas"] = tuple(options["betas"])
    optimiser = getattr(torch.optim, run["optimiser"])(parameters.values(), **options)
    losses = []
    for _ in run["losses"]:
        loss = LOSSES[run["model"]](run, parameters, lambda name: tensors[f"{run['name']}/{name}"])
        optimiser.zero_grad()
        loss.backward()
        if "clip" in run:
            # PyTorch's own clip_grad_norm_ adds 1e-6 to the norm.
            norm = torch.sqrt(sum((p.grad**2).sum() for p in parameters.values()))
            for p in parameters.values():
                p.grad *= run["clip"] / max(norm, run["clip"])
        optimiser.step()
        losses.append(loss.item())
    errors = [abs(a - b) / abs(b) for a, b in zip(run["losses"], losses)]
    return max(errors) if all(e == e for e in errors) else float("inf")


def main():
    tensors, metadata = read_safetensors(sys.argv[1])
    for run in json.loads(metadata["runs"]):
        print(f"{run['name']} {train(run, tensors):.3e}")


main()
