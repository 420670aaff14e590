"""Models whose training steps pytorch_peer.py takes; it imports this file from its own folder."""
import torch
import torch.nn.functional as F


def leaf(tensor):
    return tensor.detach().clone().requires_grad_()


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
        if name.endswith("/weight") and self.layout != "addmm (BLAS)":
            return value.t()[:, :, None, None].contiguous(memory_format=torch.channels_last)
        return value

    def gradient(self, name, grad):
        return grad.reshape(grad.shape[:2]).t() if grad.dim() == 4 else grad

    def dense(self, x, weight, bias):
        if weight.dim() == 2:
            return torch.addmm(bias, x, weight)
        x = x.view(1, -1, 1, x.shape[1]).permute(0, 3, 1, 2)
        return F.conv2d(x, weight, bias).permute(0, 2, 3, 1).reshape(-1, weight.shape[0])

    def forward(self, *parameters):
        p = dict(zip(self.names, parameters))

        def dense(name, x):
            return self.dense(x, p[name + "/weight"], p[name + "/bias"])

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


MODELS = {"transformer": (Transformer, ("addmm (BLAS)", "1x1 convolution (oneDNN)")),
          "autoencoder": (Autoencoder, ("channels last", "planes"))}
