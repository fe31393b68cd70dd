"""Times a training step in PyTorch, on 1 and 2 threads, on what `cargo bench --workspace --bench step -- --export DIR` wrote.

    python benches/peers/step.py DIR

The step is the bench's: a DiffusionNet (Sharp et al. 2022) with its weights on both shapes of a pair, functional maps of both
directions with the resolvent mask (Ren et al. 2019), the spectral loss and InfoNCE, backward, Adam. The losses must agree.
PyTorch is not among the pinned packages, because of its size: where it is not installed the peer is skipped.
"""

import sys

import common
import numpy as np

#: Relative difference of losses that counts as agreement; ours solves for the maps in double precision.
TOLERANCE = 1e-3
CASE = "diffusion net"
BLOCKS = 4
MASK_WEIGHT, SPECTRAL_WEIGHT, TEMPERATURE = 0.1, 0.02, 0.07
MIN_TIME, LEARNING_RATE = 1e-8, 1e-3
#: Eigenfunctions of the maps, and points that InfoNCE tells apart, the first ones, as in the bench.
K_MAP, CONTRASTED = 100, 1024
STEPS = 8

torch = common.package("torch")


def main():
    arguments = common.options(__doc__)
    if torch is None:
        sys.exit(0)
    folder = arguments.folder / "step"
    arrays = {path.stem: torch.from_numpy(np.load(path)) for path in folder.glob("*.npy")}
    expected = arrays.pop("loss").item()
    for threads in (1, 2):
        torch.set_num_threads(threads)
        step = make_step(arrays)
        loss = step()
        difference = abs(loss - expected) / expected
        cost, _ = common.least(1 if arguments.quick else STEPS, step)
        text = f"losses within {difference:.0e}"
        common.tell(f"step-{CASE}", "PyTorch", cost | {"threads": threads}, text, difference < TOLERANCE)


def make_step(arrays):
    """What takes a step and returns the loss before it."""
    prefix = "parameter-"
    weights = {name.removeprefix(prefix): array.clone() for name, array in arrays.items() if name.startswith(prefix)}
    for weight in weights.values():
        weight.requires_grad_()
    pair = [Shape(arrays, side) for side in ("source", "target")]
    masks = [resolvent_mask(*(shape.map_eigenvalues for shape in order)) for order in (pair, pair[::-1])]
    optimizer = torch.optim.Adam(weights.values(), lr=LEARNING_RATE)

    def step():
        optimizer.zero_grad(set_to_none=True)
        loss = loss_of(weights, pair, masks)
        loss.backward()
        optimizer.step()
        return loss.item()

    return step


class Shape:
    """A shape's features [n, inputs], operators [n, k], and weighted eigenfunctions of its map [n, k_map]."""

    def __init__(self, arrays, side):
        get = lambda name: arrays[f"{side}-{name}"]
        self.features, self.eigenvalues, self.map_eigenvalues = get("features"), get("eigenvalues"), get("map-eigenvalues")
        self.eigenvectors, self.gradients = get("eigenvectors"), [get("gradients_x"), get("gradients_y")]
        self.weighted = self.eigenvectors * get("mass")[:, None]
        self.map_weighted = get("basis") * get("mass")[:, None]


def loss_of(weights, pair, masks):
    x, y = (descriptors(weights, shape) for shape in pair)
    f, g = pair[0].map_weighted.T @ x, pair[1].map_weighted.T @ y
    maps = [functional_map(f, g, masks[0]), functional_map(g, f, masks[1])]
    identity = torch.eye(K_MAP)
    spectral = sum(((c - identity) ** 2).sum() for c in maps)
    return SPECTRAL_WEIGHT * spectral + info_nce(x[:CONTRASTED], y[:CONTRASTED])


def descriptors(weights, shape):
    """[n, outputs]; the equations stand in the runtime's module `diffusion_net`."""
    linear = lambda x, name: torch.addmm(weights[f"{name}.bias"], x, weights[f"{name}.weight"])
    x = linear(shape.features, "input")
    for block in (f"blocks.{i}" for i in range(BLOCKS)):
        time = weights[f"{block}.time"].clamp(min=MIN_TIME)
        spread = torch.exp(-shape.eigenvalues[:, None] * time) * (shape.weighted.T @ x)
        u, v = (gradient @ spread for gradient in shape.gradients)
        real, imaginary = weights[f"{block}.gradient.real"], weights[f"{block}.gradient.imaginary"]
        directions = torch.tanh(u * (u @ real - v @ imaginary) + v * (v @ real + u @ imaginary))
        hidden = torch.cat([x, shape.eigenvectors @ spread, directions], dim=1)
        hidden = torch.relu(linear(hidden, f"{block}.mlp1"))
        hidden = torch.relu(linear(hidden, f"{block}.mlp2"))
        x = x + linear(hidden, f"{block}.mlp3")
    return linear(x, "output")


def resolvent_mask(source, target):
    """[k_target, k_source]."""
    root = lambda values: torch.sqrt(values / torch.maximum(source.max(), target.max()))
    resolvent = lambda g: torch.complex(g, torch.ones_like(g)) / (g**2 + 1)
    return (resolvent(root(target))[:, None] - resolvent(root(source))[None, :]).abs() ** 2


def functional_map(f, g, mask):
    """C [k, k] from coefficients [k, d], a system for each row: (F F^T + weight d diag(mask_i)) c_i = F g_i."""
    gram = f @ f.T
    systems = gram + torch.diag_embed(MASK_WEIGHT * gram.diagonal().mean() * mask)
    right = (g @ f.T)[:, :, None]
    return torch.cholesky_solve(right, torch.linalg.cholesky(systems))[:, :, 0]


def info_nce(x, y):
    """The mean over both directions of the cross entropy of telling each point's counterpart by cosines."""
    x, y = (rows / rows.norm(dim=1, keepdim=True) for rows in (x, y))
    logits, own = x @ y.T / TEMPERATURE, torch.arange(len(x))
    entropy = torch.nn.functional.cross_entropy
    return (entropy(logits, own) + entropy(logits.T, own)) / 2


if __name__ == "__main__":
    main()
