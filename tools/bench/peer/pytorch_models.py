"""Models whose training steps pytorch_peer.py takes; it imports this file from its own folder."""
import itertools
import math

import torch
import torch.nn.functional as F


def leaf(tensor):
    return tensor.detach().clone().requires_grad_()


def as_window(matrix):
    """Returns a matrix [in, out] as the weight of a 1 x 1 convolution."""
    return matrix.t()[:, :, None, None].contiguous(memory_format=torch.channels_last)


def as_matrix(window):
    """Inverts as_window(); returns anything else unchanged."""
    return window.reshape(window.shape[:2]).t() if window.dim() == 4 else window


def product(x, weight, bias):
    """Computes x W + b, by BLAS, or by oneDNN if W is the weight of a convolution."""
    if weight.dim() == 2:
        return torch.addmm(bias, x, weight)
    x = x.view(1, -1, 1, x.shape[1]).permute(0, 3, 1, 2)
    return F.conv2d(x, weight, bias).permute(0, 2, 3, 1).reshape(-1, weight.shape[0])


class Training:
    """Steps of Adam on the loss of a model; forward() and parameter() are the model's."""

    def __init__(self, metadata, case, names, foreach, traced):
        self.metadata, self.case, self.names = metadata, case, names
        self.foreach, self.traced = foreach, traced
        self.name = ", ".join([self.layout] + ["Adam for all at once"] * foreach + ["traced"] * traced)
        self.begin()

    def begin(self):
        self.parameters = {name: leaf(self.parameter(name, self.case["value/" + name])) for name in self.names}
        self.optimiser = torch.optim.Adam(self.parameters.values(), foreach=self.foreach)
        self.loss = self.forward
        if self.traced:
            self.loss = torch.jit.trace(self.forward, tuple(self.parameters.values()), check_trace=False)

    def step(self):
        self.optimiser.zero_grad(set_to_none=True)
        loss = self.loss(*self.parameters.values())
        loss.backward()
        self.optimiser.step()
        return loss

    def probe(self):
        """A traced model compiles in its first steps."""
        for _ in range(3 if self.traced else 0):
            self.step()
        return 0

    def results(self):
        self.begin()
        losses, found = [], {}
        for _ in range(len(self.case["y"])):
            losses.append(self.step().detach())
            found = found or {name: self.gradient(name, p.grad.clone()) for name, p in self.parameters.items()}
        return {"y": torch.stack(losses), **found}


class Transformer(Training):
    """A block of attention with a causal mask, a norm and two dense layers with GELU."""

    def __init__(self, metadata, case, names, product, *how):
        self.layout, self.heads = product, int(metadata["heads"])
        text = case["text"].long()
        self.seen, self.next = text[:-1], text[1:]
        self.letters, self.width = case["value/place"].shape
        self.mask = torch.full((self.letters, self.letters), float("-inf")).triu(1)
        super().__init__(metadata, case, names, *how)

    def parameter(self, name, value):
        return as_window(value) if name.endswith("/weight") and self.layout != BLAS else value

    def gradient(self, name, grad):
        return as_matrix(grad)

    def forward(self, *parameters):
        p = dict(zip(self.names, parameters))

        def dense(name, x):
            return product(x, p[name + "/weight"], p[name + "/bias"])

        embedded = F.embedding(self.seen, p["letter"]).view(-1, self.letters, self.width) + p["place"]
        embedded = embedded.view(-1, self.width)
        qkv = dense("qkv", embedded).view(-1, self.letters, 3, self.heads, self.width // self.heads)
        q, k, v = qkv.permute(2, 0, 3, 1, 4).unbind(0)
        scores = q @ k.transpose(-2, -1) * (self.width // self.heads) ** -0.5 + self.mask
        mixed = (scores.softmax(-1) @ v).transpose(1, 2).reshape(-1, self.width)
        x = embedded + dense("mix", mixed)
        h = F.layer_norm(x, (self.width,), p["gamma"], p["beta"])
        return F.cross_entropy(dense("out", x + dense("narrow", F.gelu(dense("wide", h)))), self.next)


class Autoencoder(Training):
    """Convolutions with ReLU, average pooling to a code and nearest-neighbour upsampling back."""

    def __init__(self, metadata, case, names, layout, *how):
        self.layout = layout
        self.format = torch.channels_last if layout == "channels last" else torch.contiguous_format
        self.x = case["images"].permute(0, 3, 1, 2).contiguous(memory_format=self.format)
        super().__init__(metadata, case, names, *how)

    def parameter(self, name, value):
        return value.permute(3, 2, 0, 1).contiguous(memory_format=self.format) if value.dim() == 4 else value

    def gradient(self, name, grad):
        return grad.permute(2, 3, 1, 0) if grad.dim() == 4 else grad

    def forward(self, *parameters):
        p = dict(zip(self.names, parameters))

        def conv(name, x):
            return F.conv2d(x, p[name + "/weight"], p[name + "/bias"], padding=1)

        h = F.avg_pool2d(torch.relu_(conv("e1", self.x)), 2)
        z = conv("code", F.avg_pool2d(torch.relu_(conv("e2", h)), 2))
        h = torch.relu_(conv("d1", F.interpolate(z, scale_factor=2)))
        h = torch.relu_(conv("d2", F.interpolate(h, scale_factor=2)))
        return F.mse_loss(conv("image", h), self.x)


class Paper(Training):
    """E, D and G paint a message into each image, and H reads it; the loss is that of preset paper."""

    def __init__(self, metadata, case, names, layout, dense, once, singly, *how):
        self.layout = ", ".join([layout, dense] + ["a product per message"] * once + ["image by image"] * singly)
        self.blocked, self.blas = layout == BLOCKED, dense == BLAS
        self.once, self.singly = once, singly
        self.format = torch.channels_last if layout == "channels last" else torch.contiguous_format
        self.side = int(metadata["side"])
        self.x, self.d, self.c = case["x"], case["d"], case["c"]
        self.count, self.samples = self.x.shape[:2]
        self.message, self.weight = case["message"], case["weight"][:, None]
        pixels = self.side ** 2
        self.behind = case["behind"].repeat(self.count, 1)
        self.place = (case["pixel"].long() + pixels * torch.arange(self.count)[:, None]).flatten()
        self.base = self.composed(self.c)
        # Blocked batch norm needs running statistics to update.
        self.running = [(torch.zeros(case["value/" + name].shape), torch.ones(case["value/" + name].shape))
                        if self.blocked else (None, None) for name in names if name.endswith("norm/beta")]
        super().__init__(metadata, case, names, *how)

    @staticmethod
    def encoded(v, bands):
        return [v] + [f(math.pi * 2 ** band * v) for band in range(bands) for f in (torch.sin, torch.cos)]

    def parameter(self, name, value):
        if value.dim() == 4:
            return value.permute(3, 2, 0, 1).contiguous(memory_format=self.format)
        return as_window(value) if value.dim() == 2 and not self.blas else value

    def gradient(self, name, grad):
        if grad.dim() == 4 and grad.shape[2] == 3:
            return grad.permute(2, 3, 1, 0)
        return as_matrix(grad)

    def composed(self, colour):
        marked = (self.weight * colour).view(-1, 3)
        return self.behind + torch.zeros_like(self.behind).index_copy(0, self.place, marked)

    def forward(self, *parameters):
        p = dict(zip(self.names, parameters))
        step = 1 if self.singly else self.count
        parts = [self.painted(p, slice(i, i + step)) for i in range(0, self.count, step)]
        marked = self.composed(torch.cat(parts))
        content = ((marked - self.base) ** 2).mean()
        logits = self.read(p, marked.view(-1, self.side, self.side, 3).permute(0, 3, 1, 2))
        return 60 * content + 5 * F.binary_cross_entropy_with_logits(logits, (self.message + 1) / 2)

    def painted(self, p, images):
        """The colours [images, samples, 3] that E, D and G give."""
        x, d, c = (v[images].flatten(0, 1) for v in (self.x, self.d, self.c))

        def dense(x, name):
            return product(x, p[name + "/weight"], p[name + "/bias"])

        f = torch.cat([*self.encoded(x, 10), *self.encoded(d, 4), c], 1)
        for k in range(3):
            f = torch.relu_(dense(f, "mark/encode/%d" % k))
        f = dense(f, "mark/encode/3")
        m = torch.relu_(dense(torch.relu_(dense(self.message[images], "mark/message/0")), "mark/message/1"))
        if self.once:
            h = self.in_parts(f, m, c, p["mark/fuse/0/weight"], p["mark/fuse/0/bias"])
        else:
            h = dense(torch.cat([f, m.repeat_interleave(self.samples, 0), c], 1), "mark/fuse/0")
        h = torch.relu_(dense(torch.relu_(h), "mark/fuse/1"))
        return torch.sigmoid(dense(h, "mark/fuse/2")).view(-1, self.samples, 3)

    def in_parts(self, f, m, c, weight, bias):
        axis = 0 if weight.dim() == 2 else 1
        of_f, of_m, of_c = weight.split([f.shape[1], m.shape[1], 3], axis)
        own = product(m, of_m, bias)
        each = product(torch.cat([f, c], 1), torch.cat([of_f, of_c], axis), torch.zeros(own.shape[1]))
        return (each.view(m.shape[0], self.samples, -1) + own[:, None]).flatten(0, 1)

    def read(self, p, images):
        x = (2 * images - 1).contiguous(memory_format=self.format)
        x = x.to_mkldnn() if self.blocked else x
        for k, running in enumerate(self.running):
            block = "reader/%d/" % k
            x = F.conv2d(x, p[block + "conv/weight"], p[block + "conv/bias"], padding=1)
            x = F.batch_norm(x, *running, p[block + "norm/gamma"], p[block + "norm/beta"], True, 0.1, 1e-5)
            x = torch.relu(x) if self.blocked else torch.relu_(x)
        x = x.to_dense() if self.blocked else x
        return product(x.mean((2, 3)), p["reader/linear/weight"], p["reader/linear/bias"])


def blas():
    """Which library serves addmm: Debian's reference BLAS is some 50 times slower than OpenBLAS."""
    if torch.backends.mkl.is_available():
        return "mkl"
    with open("/proc/self/maps") as maps:
        files = {line.split()[-1] for line in maps if "/" in line}
    for word in ("openblas", "blis", "atlas", "mkl_rt"):
        if any(word in file for file in files):
            return word
    return "reference"


BLAS, BLOCKED, BOTH = "addmm (BLAS)", "oneDNN blocked", (False, True)
LAYOUTS = ("channels last", "planes")
PRODUCTS = (BLAS, "1x1 convolution (oneDNN)")
# Reference BLAS would take minutes for large products.
LARGE_PRODUCTS = PRODUCTS[1:] if blas() == "reference" else PRODUCTS
PAPER = itertools.product((*LAYOUTS, BLOCKED), LARGE_PRODUCTS, BOTH, BOTH, (True,), BOTH)
# The choices that each constructor takes; the last two are Adam for all at once and a trace. Blocked tensors cannot be
# traced, and a trace of eight images one by one takes long.
MODELS = {"transformer": (Transformer, list(itertools.product(PRODUCTS, BOTH, BOTH))),
          "autoencoder": (Autoencoder, list(itertools.product(LAYOUTS, BOTH, BOTH))),
          "paper": (Paper, [chosen for chosen in PAPER if not chosen[-1] or (chosen[0] != BLOCKED and not chosen[3])])}
