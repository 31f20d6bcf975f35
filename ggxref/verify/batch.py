"""One-point functions of the library as functions of NumPy arrays in float64: compiled once each, whatever the batch."""

import inspect
from collections.abc import Callable, Sequence
from functools import cache, partial
from importlib import import_module
from threading import Lock

import jax
import jax.numpy as jnp
import numpy as np

# One compiled size serves every batch: padding 4096 rows costs less than a millisecond, a compilation a hundred.
ROWS = 1 << 12

# Rank of one point of an argument, by the argument's name: names and shapes are part of the package's contract.
_VECTORS = ("w", "wi", "wo", "wm", "u", "v", "alpha", "angles", "slope", "factors", "mean")
_MATRICES = ("A", "M", "scatter")
RANKS: dict[str, int] = {**dict.fromkeys(_VECTORS, 1), **dict.fromkeys(_MATRICES, 2)}


class Batched:
    """`function` of one point, mapped over the leading axes of its arguments, which broadcast.

    Arguments are positional; `policy` is passed on as it is. Results are float64 arrays of NumPy.
    """

    def __init__(self, function: Callable, ranks: Sequence[int]):
        self.function = function
        self.ranks = tuple(ranks)

    def __call__(self, *args, **policy):
        args = [np.asarray(a, np.float64) for a in args]
        cores = [a.shape[a.ndim - rank :] for a, rank in zip(args, self.ranks, strict=True)]
        lead = np.broadcast_shapes(*(a.shape[: a.ndim - rank] for a, rank in zip(args, self.ranks, strict=True)))
        flat = [np.broadcast_to(a, lead + core).reshape(-1, *core) for a, core in zip(args, cores, strict=True)]
        mapped, lock = _compiled(self.function, tuple(sorted(policy.items())))
        with lock, jax.enable_x64(True):
            blocks = [_padded(mapped, [a[i : i + ROWS] for a in flat]) for i in range(0, len(flat[0]), ROWS)]
        joined = jax.tree.map(lambda *parts: np.concatenate(parts), *blocks)
        return jax.tree.map(lambda a: a.reshape(lead + a.shape[1:]), joined)

    def area_ratio(self, argument: int) -> "Batched":
        """|∂f/∂x| as a ratio of areas, by forward differentiation with respect to the argument at that position.

        The argument is a unit vector, varied in its tangent plane, or a point of the plane; so is the value of f.
        """
        return Batched(_area_ratio(self.function, argument), self.ranks)

    def derivative(self, argument: int) -> "Batched":
        """∂f/∂x by forward differentiation with respect to the argument at that position: its axes come last."""
        return Batched(_derivative(self.function, argument), self.ranks)


def batched(name: str) -> Batched:
    """The library's function of that dotted name below `ggxref`, looked up at each call so that it can be replaced."""
    module, _, attribute = name.rpartition(".")
    function = getattr(import_module(f"ggxref.{module}"), attribute)
    parameters = inspect.signature(function).parameters.values()
    ranks = [RANKS.get(p.name, 0) for p in parameters if p.kind is not p.KEYWORD_ONLY]
    if "rejection" in attribute:  # one row of u a try
        ranks[0] = 2
    return Batched(function, ranks)


@cache
def _compiled(function, policy):
    """The mapped function, and the lock that keeps two threads from compiling it twice."""
    return jax.jit(jax.vmap(partial(function, **dict(policy)))), Lock()


def forget() -> None:
    """Drop the compiled functions, which know nothing of a formula that was replaced since."""
    _compiled.cache_clear()
    _area_ratio.cache_clear()
    _derivative.cache_clear()


def _padded(mapped, block):
    rows = len(block[0])
    filled = [np.concatenate([a, np.broadcast_to(a[:1], (ROWS - rows, *a.shape[1:]))]) for a in block]
    return jax.tree.map(lambda a: np.asarray(a)[:rows], mapped(*map(jnp.asarray, filled)))


def _tangents(x):
    """Two orthonormal directions to vary `x` in: the axes of the plane, or (Duff et al. 2017) the tangents at a unit x."""
    if x.shape == (2,):
        return jnp.eye(2, dtype=x.dtype)
    s = jnp.where(x[2] < 0, -1.0, 1.0)
    a = -1 / (s + x[2])
    c = x[0] * x[1] * a
    return jnp.array([[1 + s * x[0] ** 2 * a, s * c, -s * x[0]], [c, s + x[1] ** 2 * a, -x[1]]])


@cache
def _area_ratio(function, argument):
    def ratio(*args):
        def varied(x):
            return function(*args[:argument], x, *args[argument + 1 :])

        x = args[argument]
        first, second = jax.vmap(lambda t: jax.jvp(varied, (x,), (t,))[1])(_tangents(x))
        if first.shape == (2,):
            return jnp.abs(first[0] * second[1] - first[1] * second[0])
        return jnp.linalg.norm(jnp.cross(first, second))

    return ratio


@cache
def _derivative(function, argument):
    return jax.jacfwd(function, argument)
