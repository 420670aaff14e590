"""Random graphs of the engine's ops in PyTorch.

python3 torch_graphs.py FILE: FILE is a safetensors file. Its metadata `graphs` lists graphs, each a list of steps
{"op", "in", args..}; tensors G/inN are the inputs of graph G, G/u its cotangent, G/y the value and G/dN the gradients that
Fieldmark found. Prints a line for each graph: its number, and the worst relative error of the value and of the gradients,
against PyTorch in double.
"""
import json
import operator
import sys

import torch
import torch.nn.functional as F

from safetensors_file import read_safetensors

torch.set_num_threads(1)  # small tensors: threads would only wait for each other


def index(args):
    return torch.tensor(args["index"])


def scatter_add(x, a):
    shape = list(x.shape)
    shape[a["axis"]] = a["extent"]
    return torch.zeros(shape, dtype=x.dtype).index_add(a["axis"], index(a), x)


def weighted(losses, a):
    """The weighted mean that every loss is."""
    w = torch.tensor(a["weights"], dtype=losses.dtype) if a["weights"] else torch.ones(losses.numel(), dtype=losses.dtype)
    return (losses.reshape(-1) * w).sum().reshape(1) / w.sum()


def cross_entropy(x, a):
    losses = F.cross_entropy(x, index(a), reduction="none", ignore_index=-1)
    kept = (index(a) >= 0).tolist()
    weights = a["weights"] or [1] * len(kept)
    return weighted(losses, {"weights": [w * k for w, k in zip(weights, kept)]})


def bce(x, a):
    targets = torch.tensor(a["targets"], dtype=x.dtype).reshape(x.shape)
    return weighted(F.binary_cross_entropy_with_logits(x, targets, reduction="none"), a)


def images(f):
    """PyTorch's images are [N, C, H, W]."""
    return lambda x, *more, **options: f(x.permute(0, 3, 1, 2).contiguous(), *more, **options).permute(0, 2, 3, 1)


def active(y, a):
    return y.relu() if a["relu"] else y


def conv2d(v, a):
    window = {k: a[k] for k in ("stride", "padding", "dilation", "groups") if k in a}
    return active(images(F.conv2d)(v[0], v[1].permute(3, 2, 0, 1).contiguous(), v[2], **window), a)


def conv_transpose2d(v, a):
    return images(F.conv_transpose2d)(v[0], v[1].permute(3, 2, 0, 1).contiguous(), v[2], stride=a["stride"], padding=a["padding"])


def max_pool(x, a):
    return images(F.max_pool2d)(x, a["size"], a["stride"], ceil_mode=a["ceil"])


def upsample_to(v, a):
    return images(F.interpolate)(v[0], a["size"], mode=a["mode"])


def batch_norm(v, a, fixed=False):
    mean, variance = (torch.tensor(a[k], dtype=v[0].dtype) if fixed else None for k in ("mean", "variance"))
    return active(images(F.batch_norm)(v[0], mean, variance, v[1], v[2], training=not fixed), a)


def space_to_depth(x):
    n, h, w, c = x.shape
    return x.reshape(n, h // 2, 2, w // 2, 2, c).permute(0, 1, 3, 2, 4, 5).reshape(n, h // 2, w // 2, 4 * c)


def feature_distance(a, b, weights):
    unit = [x / (x.norm(dim=-1, keepdim=True) + 1e-10) for x in (a, b)]
    return ((unit[0] - unit[1]) ** 2 * torch.tensor(weights, dtype=a.dtype)).sum(-1).mean((1, 2))


def dropout(x, a):
    """PyTorch draws another mask, so ours is applied."""
    return x * torch.tensor(a["kept"], dtype=x.dtype).reshape(x.shape) / (1 - a["p"])


def fused(x, a, b):
    root = ((x - a) ** 2 + 0.5).sqrt() * torch.minimum(x, a).sigmoid()
    pole = 1 / (b ** 2 + 1) + 0.5 / (1 + (-x.abs()).exp())
    return ((x * a + b).tanh() / root + torch.maximum(x, b).relu() - (F.softplus(b) + 1).log() * pole
            + (0.3 * a + 0.1) / 2)


def number(f):
    """An operator with a number before or after the tensor."""
    return lambda v, a: f(a["number"], v[0]) if a["first"] else f(v[0], a["number"])


def triangular_solve(x, b, a):
    triangle = x.triu() if a["upper"] else x.tril()
    if a["transposed"]:
        triangle = triangle.transpose(-1, -2)
    return torch.linalg.solve_triangular(triangle, b, upper=a["upper"] != a["transposed"])


def pad(x, a):
    widths = [0, 0] * (x.dim() - 1 - a["axis"]) + [a["before"], a["after"]]
    return F.pad(x, widths, value=a["value"])


OPS = {
    "add": lambda v, a: v[0] + v[1],
    "sub": lambda v, a: v[0] - v[1],
    "mul": lambda v, a: v[0] * v[1],
    "div": lambda v, a: v[0] / v[1],
    "pow": lambda v, a: v[0] ** v[1],
    "minimum": lambda v, a: torch.minimum(v[0], v[1]),
    "maximum": lambda v, a: torch.maximum(v[0], v[1]),
    "greater": lambda v, a: (v[0] > v[1]).to(v[0].dtype),
    "less": lambda v, a: (v[0] < v[1]).to(v[0].dtype),
    "equal": lambda v, a: (v[0] == v[1]).to(v[0].dtype),
    "where": lambda v, a: torch.where(v[0] != 0, v[1], v[2]),
    "operator+": number(operator.add),
    "operator-": number(operator.sub),
    "operator*": number(operator.mul),
    "operator/": number(operator.truediv),
    "scale": lambda v, a: v[0] * a["factor"],
    "affine": lambda v, a: v[0] * a["factor"] + a["offset"],
    "pow_number": lambda v, a: v[0] ** a["p"],
    "div_number": lambda v, a: v[0] / a["divisor"],
    "negate": lambda v, a: -v[0],
    "reciprocal": lambda v, a: 1 / v[0],
    "abs": lambda v, a: v[0].abs(),
    "square": lambda v, a: v[0] ** 2,
    "sqrt": lambda v, a: v[0].sqrt(),
    "log": lambda v, a: v[0].log(),
    "log1p": lambda v, a: v[0].log1p(),
    "expm1": lambda v, a: v[0].expm1(),
    "sin": lambda v, a: v[0].sin(),
    "cos": lambda v, a: v[0].cos(),
    "clamp": lambda v, a: v[0].clamp(a["low"], a["high"]),
    "exp": lambda v, a: v[0].exp(),
    "tanh": lambda v, a: v[0].tanh(),
    "sigmoid": lambda v, a: v[0].sigmoid(),
    "softplus": lambda v, a: torch.logaddexp(v[0], torch.zeros_like(v[0])),
    "relu": lambda v, a: v[0].relu(),
    "leaky_relu": lambda v, a: F.leaky_relu(v[0], a["slope"]),
    "elu": lambda v, a: F.elu(v[0], a["alpha"]),
    "silu": lambda v, a: F.silu(v[0]),
    "gelu": lambda v, a: F.gelu(v[0]),
    "normal_cdf": lambda v, a: torch.special.ndtr(v[0]),
    "truncated_exp": lambda v, a: v[0].exp(),  # no value is near 15
    "detach": lambda v, a: v[0].detach(),
    "sum_all": lambda v, a: v[0].sum().reshape(1),
    "mean_all": lambda v, a: v[0].mean().reshape(1),
    "weighted_mean": lambda v, a: weighted(v[0], a),
    "sum": lambda v, a: v[0].sum(a["axes"], keepdim=a["keep"]),
    "mean": lambda v, a: v[0].mean(a["axes"], keepdim=a["keep"]),
    "variance": lambda v, a: v[0].var(a["axes"], unbiased=False, keepdim=a["keep"]),
    "max": lambda v, a: v[0].amax(a["axes"], keepdim=a["keep"]),
    "logsumexp": lambda v, a: v[0].logsumexp(a["axes"], keepdim=a["keep"]),
    "softmax": lambda v, a: v[0].softmax(a["axis"]),
    "softmax_last": lambda v, a: v[0].softmax(-1),
    "reshape": lambda v, a: v[0].reshape(a["shape"]),
    "permute": lambda v, a: v[0].permute(a["order"]),
    "transpose": lambda v, a: v[0].transpose(-2, -1),
    "broadcast_to": lambda v, a: v[0].expand(a["shape"]),
    "pad": lambda v, a: pad(v[0], a),
    "cumsum": lambda v, a: v[0].cumsum(a["axis"]),
    "slice": lambda v, a: v[0].narrow(a["axis"], a["begin"], a["count"]),
    "concatenate": lambda v, a: torch.cat(v, a["axis"]),
    "slice_last": lambda v, a: v[0][..., :a["count"]],
    "concatenate_last": lambda v, a: torch.cat(v, -1),
    "gather_rows": lambda v, a: v[0][index(a)],
    "broadcast_rows": lambda v, a: v[0].expand(a["rows"], -1),
    "gather": lambda v, a: v[0].index_select(a["axis"], index(a)),
    "scatter_add": lambda v, a: scatter_add(v[0], a),
    "batched_matmul": lambda v, a: v[0] @ v[1],
    "layer_norm": lambda v, a: F.layer_norm(v[0], v[0].shape[-1:], v[1], v[2]),
    "matmul": lambda v, a: v[0] @ v[1],
    "dense": lambda v, a: active(v[0] @ v[1] + v[2], a),
    "dropout": lambda v, a: dropout(v[0], a),
    "fused": lambda v, a: fused(*v),
    "conv2d": conv2d,
    "conv2d_few": conv2d,
    "conv2d_wide": conv2d,
    "conv2d_window": conv2d,
    "conv_transpose2d": conv_transpose2d,
    "avg_pool": lambda v, a: images(F.avg_pool2d)(v[0], a["size"]),
    "global_avg_pool": lambda v, a: v[0].mean((1, 2)),
    "max_pool": lambda v, a: max_pool(v[0], a),
    "upsample_nearest": lambda v, a: images(F.interpolate)(v[0], scale_factor=a["factor"]),
    "upsample_to": upsample_to,
    "upsample_to_nearest": upsample_to,
    "space_to_depth": lambda v, a: space_to_depth(v[0]),
    "batch_norm": batch_norm,
    "batch_norm_fixed": lambda v, a: batch_norm(v, a, fixed=True),
    "group_norm": lambda v, a: active(images(F.group_norm)(v[0], 2, v[1], v[2]), a),
    "feature_distance": lambda v, a: feature_distance(v[0], v[1], a["weights"]),
    "l1_loss": lambda v, a: weighted(F.l1_loss(v[0], v[1], reduction="none"), a),
    "mse_loss": lambda v, a: weighted(F.mse_loss(v[0], v[1], reduction="none"), a),
    "huber_loss": lambda v, a: weighted(F.huber_loss(v[0], v[1], reduction="none", delta=a["delta"]), a),
    "bce_with_logits": lambda v, a: bce(v[0], a),
    "softmax_cross_entropy": lambda v, a: cross_entropy(v[0], a),
    "triangular_solve": lambda v, a: triangular_solve(v[0], v[1], a),
    "solve": lambda v, a: torch.linalg.solve(v[0], v[1]),
    "inverse": lambda v, a: torch.linalg.inv(v[0]),
    "determinant": lambda v, a: torch.linalg.det(v[0]),
    "log_determinant": lambda v, a: torch.linalg.slogdet(v[0])[1],
    "cholesky": lambda v, a: torch.linalg.cholesky(v[0]),
    "symmetric_eigenvalues": lambda v, a: torch.linalg.eigvalsh(v[0]),
}


def error(got, want):
    """Largest difference relative to the largest magnitude; infinity for another shape or a NaN."""
    if got.shape != want.shape:
        return float("inf")
    if want.numel() == 0:
        return 0.0
    worst = ((got - want).abs().max() / want.abs().max().clamp(min=1e-3)).item()
    return worst if worst == worst else float("inf")


def run_graph(number, steps, tensors):
    """Value and gradients of the inputs."""
    values, inputs = [], []
    for step in steps:
        if step["op"] == "input":
            inputs.append(tensors[f"{number}/in{len(inputs)}"].double().requires_grad_())
            values.append(inputs[-1])
        else:
            values.append(OPS[step["op"]]([values[i] for i in step["in"]], step))
    y = values[-1]
    grads = torch.autograd.grad(y, inputs, tensors[f"{number}/u"].double(), allow_unused=True)
    grads = [torch.zeros_like(x) if grad is None else grad for x, grad in zip(inputs, grads)]
    return y.detach(), grads


def errors(got, want):
    """Of the value, and the worst of the gradients."""
    (y, grads), (want_y, want_grads) = got, want
    return error(y, want_y), max(error(a, b) for a, b in zip(grads, want_grads))


def main():
    tensors, metadata = read_safetensors(sys.argv[1])
    for number, steps in enumerate(json.loads(metadata["graphs"])):
        want = run_graph(number, steps, tensors)
        ours = tensors[f"{number}/y"], [tensors[f"{number}/d{i}"] for i in range(len(want[1]))]
        print(number, *(f"{e:.3e}" for e in errors(ours, want)))


main()
