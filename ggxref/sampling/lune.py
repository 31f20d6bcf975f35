"""Visible normals of the ellipsoid NDF through the silhouette of a lune: walter2014 §4, versions 1 to 3."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ggxref import _special, stable
from ggxref._canonical import canonical_frame
from ggxref._matrix import length, near_one, plain_cross, reciprocal_scale, times
from ggxref._types import Mat3, Scalar, Vec2, Vec3
from ggxref.ellipsoid import cofactor
from ggxref.geometry import basis
from ggxref.sampling._ellipsoid import image, risen, shortened, to_sphere
from ggxref.sampling._lune import point
from ggxref.sampling._visible import pdf_ellipsoid as pdf

__all__ = ["pdf", "sample", "sample_rejection_ellipsoid", "sample_rejection_sphere"]


@stable.widened
def sample(u: Vec2, wi: Vec3, A: Mat3) -> Vec3:
    """Draw a point of the disk, compress it to the lune's crescent, lift it to the sphere, map it to the ellipsoid.

    - `u`: in [0, 1)², (2,). `wi`: unit, (3,), anywhere but where A ω_i points along -A n.
    - `A`: shape matrix, (3, 3), non-singular, of either sign.
    - Returns a micronormal with density `pdf`: unit, (3,), above the horizon for `u > 0` (0 is the disk's rim).

    walter2014 (34)–(46), version 3. Where ω_i = n, (43) leaves e₂ free: it is the second row of `geometry.basis(e3)`.
    """
    frame = canonical_frame(A)
    x, (y, y_rest), z = to_sphere(wi, frame.terms)
    i, _ = shortened((x, (stable.plus_zero_times(y, frame.lower, wi[0]), y_rest), z))
    p = risen(point(u, i, frame.side, frame.pole), frame.terms)
    x, y, z = image(p, frame.terms)
    return stable.direction(stable.plus_zero_times(x, frame.lower, p[1][0]), y, z)


Tries = Float[Array, "n 2"]


def _first(accepted, wm):
    """The first accepted row and its number from 1; the zero vector and 0 where there is none."""
    row = jnp.argmax(accepted)
    found = accepted[row]
    return jnp.where(found, wm[row], 0), jnp.where(found, row + 1, 0)


def _disk(u):
    cos_phi, sin_phi = _special.cos_sin_turn(u[0])
    r = stable.sqrt(u[1])
    return r * cos_phi, r * sin_phi


def _plainly_along(M, x):
    # What cancels is computed once: contracted to FMAs here and not there, it would not have the length that is divided by.
    return jnp.stack(stable.unit(*stable.one_loop(*times(M, *x))))


@jax.custom_jvp
def _along(M: Mat3, cof: Mat3, x: Vec3) -> Vec3:
    """The unit vector along `M x`. `cof`: M's cofactor matrix.

    Of M dx, a smooth ellipsoid leaves most along M x: what turns it is left by M x × M dx = cof (x × dx) alone.
    """
    return _plainly_along(M, x)


@_along.defjvp
def _along_jvp(primals, tangents):
    (M, cof, x), (dM, _, dx) = primals, tangents
    value, change = jax.jvp(lambda M: _plainly_along(M, x), (M,), (dM,))
    size = length(*times(M, *x))
    turn = jnp.stack(times(cof, *plain_cross(x, dx))) / size
    return value, change + jnp.stack(plain_cross(turn, value)) / size


@stable.widened
def sample_rejection_ellipsoid(u: Tries, wi: Vec3, A: Mat3) -> tuple[Vec3, Int[Array, ""]]:
    """Version 2: points of the ellipsoid's own silhouette until one lies on the lune.

    - `u`: in [0, 1), (n, 2), a row a try. `wi`, `A`: as `sample`.
    - Returns the first accepted micronormal, unit, (3,), and the number of tries that it took; the zero vector and 0
      where all n fail. Not differentiable in the choice of the row.

    walter2014 §4, version 2. Disk point: `r = sqrt(u[1])`, turned by `u[0]` in the frame `geometry.basis(A wi)`.
    """
    A, _ = near_one(A)
    cof, _ = cofactor(A)
    e3 = _along(A, cof, wi)
    t, b, _ = basis(e3)

    def attempt(u):
        x, y = _disk(u)
        m = _along(A.T, cof.T, x * t + y * b + stable.sqrt(1 - u[1]) * e3)
        return m[2] > 0, m

    return _first(*jax.vmap(attempt)(u))


def _largest_row(M):
    """The longest of three perpendicular rows that are `M`'s, turned among themselves: M's largest singular value, times what
    belongs to it on the right.

    Hestenes' rotations of two rows at a time, five times around. (LAPACK is not there until SciPy is imported, which takes half as
    long as compiling the sampler.)
    """

    def turn(_, rows):
        a, b, c = rows
        p, q = (a * b).sum(), ((a - b) * (a + b)).sum() / 2
        total = jnp.sqrt(p * p + q * q) + jnp.abs(q)
        tangent = jnp.where(q < 0, -p, p) / jnp.where(total > 0, total, 1)
        cosine = jax.lax.rsqrt(1 + tangent * tangent)
        return jnp.stack([cosine * (b - tangent * a), c, cosine * (a + tangent * b)])

    rows = jax.lax.fori_loop(0, 15, turn, M)
    return rows[jnp.argmax((rows * rows).sum(1))]


@jax.custom_jvp
def _largest_singular(M: Mat3) -> Scalar:
    return length(*_largest_row(M))


@_largest_singular.defjvp
def _largest_singular_jvp(primals, tangents):
    (M,), (dM,) = primals, tangents
    row = _largest_row(M)
    value = length(*row)
    right = row / value
    return value, (((M * right).sum(1) / value) * (dM * right).sum(1)).sum()


@stable.widened
def sample_rejection_sphere(u: Tries, wi: Vec3, A: Mat3) -> tuple[Vec3, Int[Array, ""]]:
    """Version 1: rays through the silhouette of the bounding sphere until one meets the lune.

    - As `sample_rejection_ellipsoid`; the frame is `geometry.basis(wi)` and the sphere's radius is the ellipsoid's
      longest half axis.

    walter2014 §4, version 1.
    """
    A, _ = near_one(A)
    cof, det = cofactor(A)
    # The longest half axis: the largest singular value of A^{-T}, which has more digits than the smallest of A.
    scale = reciprocal_scale(jnp.abs(cof).max())
    radius = _largest_singular(cof * scale) / jnp.abs(det * scale)
    t, b, _ = basis(wi)
    e3 = _along(A, cof, wi)
    # The ray hits the sphere-space sphere at q + sqrt(1 - q²) e3, where q, its point nearest to the centre, is
    # (A ωi × A d) × e3 / |A ωi| for any point d of the ray. A ωi × A d = cof(A) (ωi × d) leaves out the long way along e3.
    reach = cof / length(*times(A, *wi))
    by_x, by_y = times(reach, *(radius * b)), times(reach, *(radius * t))

    def attempt(u):
        x, y = _disk(u)
        moment = tuple(x * p - y * q for p, q in zip(by_x, by_y, strict=True))
        miss = moment[0] * moment[0] + moment[1] * moment[1] + moment[2] * moment[2]
        p = jnp.stack(plain_cross(moment, e3)) + stable.sqrt(1 - miss) * e3
        m = _along(A.T, cof.T, p)
        return (miss <= 1) & (m[2] > 0), m

    return _first(*jax.vmap(attempt)(u))
