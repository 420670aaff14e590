"""Colours of an mlp field by PyTorch, from its file alone.

python3 torch_field.py FIELD RAYS: reads the networks and their sizes from FIELD, and from RAYS position [S, 3] and
delta [S] of samples, ray_begin [R + 1], direction [R, 3] and rgba [R, 4], what Fieldmark drew. Prints the largest
difference between those and PyTorch's own colours and opacities. Products are oneDNN's in float, which round by 1e-6:
in double, Debian's reference BLAS would take five times as long. All else is in double.
"""
import json
import math
import sys

import torch

from safetensors_file import read_safetensors

RAYS_TOGETHER = 64


def gamma(p, bands):
    """The vector itself, then its sines and cosines, band after band."""
    parts = [p]
    for band in range(bands):
        parts += [torch.sin(2.0**band * math.pi * p), torch.cos(2.0**band * math.pi * p)]
    return torch.cat(parts, dim=1)


class Networks:
    """The fine network of a FIELD of kind mlp."""

    def __init__(self, path):
        self.tensors, metadata = read_safetensors(path)
        config = json.loads(metadata["fieldmark"])["config"]
        self.config = json.loads(config) if isinstance(config, str) else config
        assert self.config["kind"] == "mlp", self.config

    def linear(self, name, x):
        weight, bias = (self.tensors[name + part].float() for part in ("/weight", "/bias"))
        return torch.nn.functional.linear(x.float().to_mkldnn(), weight.t().contiguous(), bias).to_dense().double()

    def __call__(self, x, d):
        features = gamma(2 * x - 1, self.config["position_bands"])
        h, layers = features, self.config["layers"]
        for layer in range(layers):
            if layer > 0 and layer == self.config["skip"]:
                h = torch.cat([features, h], dim=1)
            h = torch.relu(self.linear(f"density/{layer}", h))
        sigma = torch.exp(torch.clamp(self.linear(f"density/{layers}", h)[:, 0], max=15))
        view = torch.cat([self.linear("colour/0", h), gamma(d, self.config["direction_bands"])], dim=1)
        return sigma, torch.sigmoid(self.linear("colour/2", torch.relu(self.linear("colour/1", view))))


def main():
    networks = Networks(sys.argv[1])
    rays, _ = read_safetensors(sys.argv[2])
    begin = rays["ray_begin"]
    worst = torch.zeros((), dtype=torch.float64)
    for first in range(0, len(begin) - 1, RAYS_TOGETHER):
        ends = begin[first:first + RAYS_TOGETHER + 1]
        here, counts = slice(int(ends[0]), int(ends[-1])), ends[1:] - ends[:-1]
        directions = rays["direction"][first:first + len(counts)]
        sigma, rgb = networks(rays["position"][here], directions.repeat_interleave(counts, 0))
        depths = (sigma * rays["delta"][here]).split(counts.tolist())
        for r, (depth, colours) in enumerate(zip(depths, rgb.split(counts.tolist())), first):
            weight = torch.exp(depth - torch.cumsum(depth, 0)) * -torch.expm1(-depth)
            rgba = torch.cat([weight @ colours, weight.sum().reshape(1)])
            worst = torch.maximum(worst, (rgba - rays["rgba"][r]).abs().max())  # which keeps a NaN
    print(len(begin) - 1, float(worst))


if __name__ == "__main__":
    main()
