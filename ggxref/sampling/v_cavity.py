"""Visible normals of V-cavities: heitz2014 algorithm 3."""

from typing import Literal

import jax
import jax.numpy as jnp

from ggxref import ndf, stable
from ggxref._types import Scalar, Vec2, Vec3
from ggxref.sampling import normals

_SAMPLE = {"ggx": normals.sample_ggx, "beckmann": normals.sample_beckmann}
_NDF = {"ggx": ndf.ggx, "beckmann": ndf.beckmann}


@jax.custom_jvp
def _share(wm, wi):
    """Of the area that the two walls of the cavity show to `wi`, the share of the one with normal `wm`."""
    a, b = _shown(wm, wi)
    return a / jnp.where(a + b <= 0, 1, a + b)


def _shown(wm, wi):
    other = jnp.stack([-wm[0], -wm[1], wm[2]])
    return jnp.maximum(stable.cosine(wi, wm), 0), jnp.maximum(stable.cosine(wi, other), 0)


@_share.defjvp
def _share_jvp(primals, tangents):
    """Where both are seen, the share is half of ω_i·ω_m/(z_i z_m); else it does not change."""
    (wm, wi), (dm, di) = primals, tangents
    a, b = _shown(wm, wi)
    _, change = jax.jvp(lambda w, m: stable.over_heights(w, m, a), (tuple(wi), tuple(wm)), (tuple(di), tuple(dm)))
    return _share(wm, wi), jnp.where((a > 0) & (b > 0), change / 2, 0)


@stable.widened
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
    return jnp.where(wi[2] <= 0, 0, density)
