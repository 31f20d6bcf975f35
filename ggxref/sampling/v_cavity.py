"""Visible normals of V-cavities: heitz2014 algorithm 3."""

from typing import Literal

import jax.numpy as jnp

from ggxref import ndf, stable
from ggxref._types import Scalar, Vec2, Vec3
from ggxref.sampling import normals

_SAMPLE = {"ggx": normals.sample_ggx, "beckmann": normals.sample_beckmann}
_NDF = {"ggx": ndf.ggx, "beckmann": ndf.beckmann}


def _share(wm, wi):
    """Of the area that the two walls of the cavity show to `wi`, the share of the one with normal `wm`."""
    a = jnp.maximum(stable.cosine(wi, wm), 0)
    b = jnp.maximum(stable.cosine(wi, jnp.stack([-wm[0], -wm[1], wm[2]])), 0)
    return a / jnp.where(a + b > 0, a + b, 1)


def sample(u: Vec3, wi: Vec3, alpha: Vec2, *, distribution: Literal["ggx", "beckmann"] = "ggx") -> Vec3:
    """Draw a cavity by its projected area, then one of its walls by the area that it shows to `wi`.

    - `u`: in [0, 1)³, (3,); the third number chooses the wall. `wi`: unit, (3,), above the horizon.
    - `alpha`: positive, (2,). Returns a micronormal with density `pdf`: unit, (3,), above the horizon.

    heitz2014 algorithm 3.
    """
    wm = _SAMPLE[distribution](u[:2], alpha)
    other = jnp.stack([-wm[0], -wm[1], wm[2]])
    share = _share(other, wi)
    # A view that is NaN chooses neither wall.
    return stable.either(u[2] < share, other, stable.either(u[2] >= share, wm, jnp.full(3, jnp.nan, wm.dtype)))


@stable.widened
def pdf(wm: Vec3, wi: Vec3, alpha: Vec2, *, distribution: Literal["ggx", "beckmann"] = "ggx") -> Scalar:
    r"""$2\frac{\langle\omega_i,\omega_m\rangle}{\langle\omega_i,\omega_m\rangle + \langle\omega_i,\omega_m'\rangle}
    (\omega_m\cdot n) D(\omega_m)$, $\omega_m' = (-x_m, -y_m, z_m)$ [1/sr].

    - `wm`, `wi`: unit, (3,); 0 where `wi` is not above the horizon. `alpha`: positive, (2,).

    heitz2014 appendix B: (2) with the G1 of (3).
    """
    density = 2 * _share(wm, wi) * wm[2] * _NDF[distribution](wm, alpha)
    return jnp.where(wi[2] > 0, density, 0)
