"""The public functions over whole arrays, compiled."""

import importlib
import inspect
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np


def public(name: str) -> Callable:
    """The library's function of that dotted name below `ggxref`."""
    module, _, function = name.rpartition(".")
    return getattr(importlib.import_module(f"ggxref.{module}"), function)


def over_rows(function: Callable, inputs: dict[str, np.ndarray]):
    """`function` of each row of the inputs, as compiled; in float64 if they are."""
    wide = any(x.dtype == np.float64 for x in inputs.values())
    with jax.enable_x64(wide):
        result = jax.jit(jax.vmap(lambda row: function(**row)))(inputs)
        return jax.tree.map(np.asarray, result)


def numbers(result) -> np.ndarray:
    """Every number of each row of a result, as float64."""
    parts = jax.tree.leaves(result)
    return np.concatenate([np.asarray(part).astype(np.float64).reshape(len(part), -1) for part in parts], axis=1)


def gradient(function: Callable) -> Callable:
    """Derivative of a fixed combination of the results' numbers: NaN or infinite where any partial derivative is."""

    def combined(row):
        parts = [x for x in jax.tree.leaves(function(**row)) if jnp.issubdtype(x.dtype, jnp.floating)]
        return sum(jnp.sum(x * jnp.arange(1.0, x.size + 1, dtype=x.dtype).reshape(x.shape)) for x in parts)

    return lambda **row: jax.grad(combined)(row)


def arguments(name: str) -> list[str]:
    parameters = inspect.signature(public(name)).parameters.values()
    return [p.name for p in parameters if p.kind is not p.KEYWORD_ONLY]


# Half of the compiler's time; what is computed is the same but for rounding.
HASTE = {"xla_backend_optimization_level": 0, "xla_cpu_use_fusion_emitters": False}


def hastily(function, args):
    try:
        return jax.jit(function).lower(*args).compile(HASTE)(*args)
    except jax.errors.JaxRuntimeError:  # another version's compiler, without that option
        return jax.jit(function)(*args)
