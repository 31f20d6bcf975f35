"""What the tests share: both widths of JAX's default float."""

import jax
import jax.numpy as jnp
import pytest


@pytest.fixture(params=[False, True], ids=["x64 off", "x64 on"])
def dtype(request):
    """The default float of JAX's two modes, with that mode on."""
    with jax.enable_x64(request.param):
        yield jnp.dtype(jnp.float64 if request.param else jnp.float32)
