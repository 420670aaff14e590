"""Random graphs of the engine's ops in PyTorch.

python3 torch_graphs.py FILE: FILE is a safetensors file. Its metadata `graphs` lists graphs, each a list of steps
{"op", "in", args..}; tensors G/inN are the inputs of graph G, G/u its cotangent, G/y the value and G/dN the gradients that
Fieldmark found. Prints a line for each graph: its number, and the worst relative error of the value and of the gradients,
against PyTorch in double; where Fieldmark computed in float, also the two errors of PyTorch in float.
"""
import json
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


def triangular_solve(x, b, a):
    triangle = x.triu() if a["upper"] else x.tril()
    if a["transposed"]:
        triangle = triangle.transpose(-1, -2)
    return torch.linalg.solve_triangular(triangle, b, upper=a["upper"] != a["transposed"])


def pad(x, a):
    widths = [0, 0] * (x.dim() - 1 - a["axis"]) + [a["before"], a["after"]]
    return F.pad(x, widths, value=a["value"])


def eigenvalues(matrix):
    """Some builds of LAPACK give up on a matrix in float; its eigenvalues are then those found in double."""
    try:
        return torch.linalg.eigvalsh(matrix)
    except torch._C._LinAlgError:
        return torch.linalg.eigvalsh(matrix.double()).to(matrix.dtype)


OPS = {
    "add": lambda v, a: v[0] + v[1],
    "sub": lambda v, a: v[0] - v[1],
    "mul": lambda v, a: v[0] * v[1],
    "div": lambda v, a: v[0] / v[1],
    "pow": lambda v, a: v[0] ** v[1],
    "minimum": lambda v, a: torch.minimum(v[0], v[1]),
    "maximum": lambda v, a: torch.maximum(v[0], v[1]),
    "where": lambda v, a: torch.where(v[0] > v[1], v[0], v[2]),
    "scale": lambda v, a: v[0] * a["factor"],
    "affine": lambda v, a: v[0] * a["factor"] + a["offset"],
    "power": lambda v, a: v[0] ** a["p"],
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
    "sum": lambda v, a: v[0].sum(a["axes"], keepdim=a["keep"]),
    "mean": lambda v, a: v[0].mean(a["axes"], keepdim=a["keep"]),
    "variance": lambda v, a: v[0].var(a["axes"], unbiased=False, keepdim=a["keep"]),
    "max": lambda v, a: v[0].amax(a["axes"], keepdim=a["keep"]),
    "logsumexp": lambda v, a: v[0].logsumexp(a["axes"], keepdim=a["keep"]),
    "softmax": lambda v, a: v[0].softmax(a["axis"]),
    "reshape": lambda v, a: v[0].reshape(a["shape"]),
    "permute": lambda v, a: v[0].permute(a["order"]),
    "transpose": lambda v, a: v[0].transpose(-2, -1),
    "broadcast_to": lambda v, a: v[0].expand(a["shape"]),
    "pad": lambda v, a: pad(v[0], a),
    "cumsum": lambda v, a: v[0].cumsum(a["axis"]),
    "slice": lambda v, a: v[0].narrow(a["axis"], a["begin"], a["count"]),
    "concatenate": lambda v, a: torch.cat(v, a["axis"]),
    "gather": lambda v, a: v[0].index_select(a["axis"], index(a)),
    "scatter_add": lambda v, a: scatter_add(v[0], a),
    "batched_matmul": lambda v, a: v[0] @ v[1],
    "layer_norm": lambda v, a: F.layer_norm(v[0], v[0].shape[-1:], v[1], v[2]),
    "l1_loss": lambda v, a: F.l1_loss(v[0], v[1]).reshape(1),
    "mse_loss": lambda v, a: F.mse_loss(v[0], v[1]).reshape(1),
    "huber_loss": lambda v, a: F.huber_loss(v[0], v[1], delta=a["delta"]).reshape(1),
    "cross_entropy": lambda v, a: F.cross_entropy(v[0].reshape(-1, v[0].shape[-1]), index(a)).reshape(1),
    "triangular_solve": lambda v, a: triangular_solve(v[0], v[1], a),
    "solve": lambda v, a: torch.linalg.solve(v[0], v[1]),
    "inverse": lambda v, a: torch.linalg.inv(v[0]),
    "determinant": lambda v, a: torch.linalg.det(v[0]),
    "log_determinant": lambda v, a: torch.linalg.slogdet(v[0])[1],
    "cholesky": lambda v, a: torch.linalg.cholesky(v[0]),
    "symmetric_eigenvalues": lambda v, a: eigenvalues(v[0]),
}


def error(got, want):
    """Largest difference relative to the largest magnitude; infinity for another shape or a NaN."""
    if got.shape != want.shape:
        return float("inf")
    if want.numel() == 0:
        return 0.0
    worst = ((got - want).abs().max() / want.abs().max().clamp(min=1e-3)).item()
    return worst if worst == worst else float("inf")


def run_graph(number, steps, tensors, dtype):
    """Value and gradients of the inputs."""
    values, inputs = [], []
    for step in steps:
        if step["op"] == "input":
            inputs.append(tensors[f"{number}/in{len(inputs)}"].to(dtype).requires_grad_())
            values.append(inputs[-1])
        else:
            values.append(OPS[step["op"]]([values[i] for i in step["in"]], step))
    y = values[-1]
    grads = torch.autograd.grad(y, inputs, tensors[f"{number}/u"].to(dtype), allow_unused=True)
    grads = [torch.zeros_like(x) if grad is None else grad for x, grad in zip(inputs, grads)]
    return y.detach(), grads


def errors(got, want):
    """Of the value, and the worst of the gradients."""
    (y, grads), (want_y, want_grads) = got, want
    return error(y, want_y), max(error(a, b) for a, b in zip(grads, want_grads))


def main():
    tensors, metadata = read_safetensors(sys.argv[1])
    for number, steps in enumerate(json.loads(metadata["graphs"])):
        want = run_graph(number, steps, tensors, torch.float64)
        ours = tensors[f"{number}/y"], [tensors[f"{number}/d{i}"] for i in range(len(want[1]))]
        line = errors(ours, want)
        if metadata["precision"] == "float":
            line += errors(run_graph(number, steps, tensors, torch.float32), want)
        print(number, *(f"{e:.3e}" for e in line))


main()
