r"""Visible normals from two tables, for slope densities whose inverse has no formula: heitz2014 §5.3.

Any shape-invariant density serves every α and every anisotropy from one table, because the visible slopes are
shape-invariant too (9). The tables hold angles instead of slopes, which are infinite at their ends: the slope along is
tan ψ, the slope across $\sqrt{1 + \tan^2\psi}\,\tan\varphi$, and the normal of the hemisphere
$(-\sin\psi\cos\varphi, -\sin\varphi, \cos\psi\cos\varphi)$.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ggxref import _squares, stable
from ggxref._errorfree import two_sum
from ggxref._seen import turned_by
from ggxref._types import Scalar, Vec2, Vec3
from ggxref.sampling._sphere import incident, unturned


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Table:
    """Inverse distribution functions of one slope density at α = 1; an argument for `jit` and `vmap` like any array."""

    psi: Array  # angle of the slope along, by (θi in [0, π/2], column of u0)
    phi: Array  # angle of the slope across, by (ψ in [-π/2, π/2], column of u1)
    sigma: Array  # projected area of the visible microsurface, by θi
    density: Callable[[Vec2], Scalar] = field(metadata={"static": True})
    normals: Callable[[Vec3], Scalar] | None = field(default=None, metadata={"static": True})  # D at α = 1

    @property
    def nbytes(self) -> int:
        """Memory of the two tables."""
        return self.psi.nbytes + self.phi.nbytes


# Cells of the angles' fine grid to a cell of the table, and nodes to such a cell: the integrals at the grid's nodes are
# then exact to rounding for densities that are smooth in the angle.
_FINE, _NODES = 16, 4


def _running(values, cells):
    """Integrals from -π/2 to the edges of the grid's cells, from values at the Gauss nodes in them: (..., cells + 1)."""
    weights = np.polynomial.legendre.leggauss(_NODES)[1] / 2 * (math.pi / cells)
    steps = (values.reshape(*values.shape[:-1], cells, _NODES) * weights).sum(-1)
    return np.concatenate([np.zeros((*steps.shape[:-1], 1)), np.cumsum(steps, axis=-1)], axis=-1)


def _angles(cells):
    nodes = (np.polynomial.legendre.leggauss(_NODES)[0] + 1) / 2
    edges = np.linspace(-math.pi / 2, math.pi / 2, cells + 1)
    return edges, (edges[:-1, None] + nodes * (math.pi / cells)).ravel()


def build(
    density: Callable[[Vec2], Scalar], *, size: int = 1024, normals: Callable[[Vec3], Scalar] | None = None
) -> Table:
    r"""Tables for the slope density P22 at α = 1: `size`² numbers each, float32.

    - `density`: isotropic and normalised, from a slope (2,) to a value (); for instance
      `partial(slopes.student_t, alpha=jnp.ones(2), gamma=4.0)`. Its tails may fall no slower than GGX's.
    - `size`: at least 2. The paper's is 1024, 8 MB for both.
    - `normals`: the same at α = 1 as a density of micronormals (3,), D; for instance `partial(ndf.ggx, alpha=jnp.ones(2))`. Derivatives
      of `pdf` by grazing ω_m need it: of $P^{22}/z_m^4$ they are differences that cancel, and of P22 alone they underflow;
      at z_m = 1e-20 they are not finite.

    heitz2014 (10)–(13) and §5.3.
    """
    cells = _FINE * size
    edges, angle = _angles(cells)
    coarse = np.sin(np.linspace(0, math.pi / 2, size)) ** 2  # `_column` inverted
    rows = jax.jit(jax.vmap(jax.vmap(lambda x, y: density(jnp.stack([x, y])), (None, 0)), (0, 0)))

    def joint(psi, phi):
        """Density per unit of (ψ, φ): (rows, columns)."""
        x, scale = np.tan(psi)[:, None], 1 / np.cos(psi)[:, None]
        value = np.asarray(rows(jnp.asarray(x[:, 0]), jnp.asarray(scale * np.tan(phi))), float)
        return value * scale**3 / np.cos(phi) ** 2

    # Marginal by Gauss–Legendre in φ; then the two running moments that (10) mixes by θ.
    nodes, weights = np.polynomial.legendre.leggauss(64)
    marginal = joint(angle, nodes * math.pi / 2) @ weights * (math.pi / 2)
    mass, moment = _running(marginal, cells), _running(marginal * np.tan(angle), cells)
    psi, sigma = np.empty((size, size)), np.empty(size)
    for row, theta in enumerate(np.linspace(0, math.pi / 2, size)):
        below = np.maximum.accumulate(math.cos(theta) * mass - math.sin(theta) * moment)
        top = np.interp(math.pi / 2 - theta, edges, below)
        sigma[row] = top
        psi[row] = np.minimum(np.interp(coarse * top, below, edges), math.pi / 2 - theta)

    # The slope across does not see θ (12). At ψ = ±π/2 both scales are infinite: take the last fine cell's inside.
    inner = np.clip(np.linspace(-math.pi / 2, math.pi / 2, size), angle[0], angle[-1])
    phi = np.empty((size, size))
    for block in np.array_split(np.arange(size), max(size // 64, 1)):
        across = _running(joint(inner[block], angle), cells)
        for row, running in zip(block, across, strict=True):
            phi[row] = np.interp(coarse * running[-1], running, edges)
    single = (jnp.asarray(a, jnp.float32) for a in (psi, phi, sigma))
    return Table(*single, density=density, normals=normals)


Both = tuple[Scalar, Scalar]  # a number in [0, 1] and 1 minus it: where either is small, it keeps its digits


def _cell(place: Both, last: int):
    """The cell's ends, the one that is nearer to its end of the table first, and where in between."""
    low, high = place[0] * last, place[1] * last
    upwards = low <= high
    first = jnp.clip(jnp.floor(jnp.where(upwards, low, high)), 0, last - 1)
    weight = (jnp.where(upwards, low, high) - first).astype(low.dtype)
    first = first.astype(int)
    near, far = (jnp.where(upwards, k, last - k) for k in (first, first + 1))
    return near, far, weight


def _bilinear(table: Array, row: Both, column: Both) -> tuple[Scalar, Both]:
    """An angle between the table's entries, and its distances from -π/2 and π/2, each with its digits.

    By differences of entries, which are exact, and from the entry nearest to the table's ends, where angles are ±π/2.
    """
    last = table.shape[0] - 1
    (i, k, s), (j, m, t) = _cell(row, last), _cell(column, last)
    corner, along, down, across = (table[p, q].astype(s.dtype) for p, q in ((i, j), (i, m), (k, j), (k, m)))
    change = t * (along - corner) + s * ((down - corner) + t * ((across - along) - (down - corner)))
    low, high = (jnp.maximum(_from_right_angle(c), 0) for c in (-corner, corner))
    return corner + change, (low + change, high - change)


def _from_right_angle(angle: Scalar) -> Scalar:
    """`π/2 - angle`, rounded once."""
    value = jnp.asarray(math.pi / 2, angle.dtype)
    rest = math.pi / 2 - float(np.float32(math.pi / 2)) if angle.dtype == jnp.float32 else 6.123233995736766e-17
    total, lost = two_sum(value, -angle)
    return total + (lost + rest)


def _column(u: Scalar) -> Both:
    """Where `u` stands in a table: the inverses fall off like roots at 0 and 1, and this spreads both ends."""
    return _shares(stable.sqrt(u), stable.sqrt(1 - u))


def _shares(sine: Scalar, cosine: Scalar) -> Both:
    """An angle, and its complement, over π/2."""
    return jnp.arctan2(sine, cosine) / (math.pi / 2), jnp.arctan2(cosine, sine) / (math.pi / 2)


def _cos_sin(angle: Scalar, sides: Both) -> Both:
    """Cosine and sine of what `_bilinear` returns."""
    low, high = sides
    return jnp.sin(jnp.where(low < high, low, high)), jnp.sin(angle)


@stable.widened
def sample(u: Vec2, wi: Vec3, alpha: Vec2, table: Table) -> Vec3:
    """Look up the slope along `wi`, then the slope across; rotate and unstretch.

    - `u`: in [0, 1)², (2,). `wi`: unit, (3,), above the horizon. `alpha`: positive, (2,).
    - Returns a micronormal whose density is `pdf` but for the interpolation: unit, (3,); float32 of half precision, as the table is.

    heitz2014 algorithm 4 with the tables of §5.3.
    """
    i = incident(alpha[0] * wi[0], alpha[1] * wi[1], wi[2])
    inclination = _shares(stable.sqrt(i.x * i.x + i.y * i.y), i.z)
    psi, (low, high) = _bilinear(table.psi, inclination, _column(u[0]))
    cos_psi, sin_psi = _cos_sin(psi, (low, high))
    cos_phi, sin_phi = _cos_sin(*_bilinear(table.phi, (low / math.pi, high / math.pi), _column(u[1])))
    along, across = -sin_psi * cos_phi, -sin_phi
    return stable.direction(*unturned(along, across, cos_psi * cos_phi, wi, alpha))


@stable.widened
def pdf(wm: Vec3, wi: Vec3, alpha: Vec2, table: Table) -> Scalar:
    r"""$\max(0, \omega_i\cdot\omega_m)\,P^{22}(\tilde x/\alpha_x, \tilde y/\alpha_y)/(\alpha_x\alpha_y z_m^4\,\sigma(\omega_i))$ [1/sr].

    - `wm`, `wi`: unit, (3,); 0 where either is not above the horizon. `alpha`: positive, (2,).

    heitz2014 (6), (7), (8) with the tabulated σ.
    """
    cosine = stable.cosine(wi, wm)
    seen = ~((cosine <= 0) | (wm[2] <= 0) | (wi[2] <= 0))
    x, y, z = wm[0], wm[1], jnp.where(seen, wm[2], 1)
    share = _share(tuple(wi), tuple(wm), tuple(alpha), table.sigma, cosine)
    if table.normals is None:
        value = table.density(jnp.stack([-x / (z * alpha[0]), -y / (z * alpha[1])]))
        # Four factors: z⁴, and a quotient of quotients, which XLA divides by at once, both underflow.
        over = 1 / z
        return jnp.where(seen, value * over * over * over * over * (share / (alpha[0] * alpha[1])), 0)
    stretched = x / alpha[0], y / alpha[1], z
    lobe = math.pi * _squares.lobe(alpha[0], alpha[1], _squares.stretched_square(jnp.stack([x, y, z]), alpha))
    return jnp.where(seen, table.normals(stable.direction(*stretched)) * lobe * share, 0)


def _inclined(w, alpha, last):
    """‖(x, y)‖ and length of the stretched direction, the cell of its inclination and where in it."""
    s = stable.sqrt((alpha[0] * w[0]) ** 2 + (alpha[1] * w[1]) ** 2)
    place = jnp.minimum(jnp.arctan2(s, w[2]) / (math.pi / 2), 1) * last
    cell = jnp.clip(jnp.floor(place), 0, last - 1)
    return s, stable.sqrt(s * s + w[2] ** 2), cell.astype(int), place - cell


def _between(values, cell, t):
    """Linear between the ends of a cell."""
    return values[cell] * (1 - t) + values[cell + 1] * t


@jax.custom_jvp
def _share(w, m, alpha, sigma, cosine):
    r"""$\omega\cdot m/\sigma(\omega)$ by the table of σ. `cosine` is $\omega\cdot m$."""
    _, norm, *place = _inclined(w, alpha, sigma.shape[0] - 1)
    return cosine / (norm * _between(sigma, *place))


@_share.defjvp
def _share_jvp(primals, tangents):
    (w, _, alpha, sigma, _), dsigma = primals, tangents[3]
    last = sigma.shape[0] - 1
    s, norm, cell, t = _inclined(w, alpha, last)
    value, by_angle = _between(sigma, cell, t), (sigma[cell + 1] - sigma[cell]) * (last / (math.pi / 2))
    by_z, by_s = (value * w[2] - by_angle * s) / norm, (value * s + by_angle * w[2]) / norm
    by_square = jnp.where(s > 0, by_s / jnp.where(s > 0, s, 1), 0)
    quotient = _share(*primals)
    change = turned_by(primals, tangents, quotient, norm * value, by_z, by_square)
    return quotient, change - quotient * (_between(dsigma, cell, t) / value)
