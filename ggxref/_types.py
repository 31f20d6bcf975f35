"""Shapes of the arrays that the public functions take and return."""

from collections.abc import Callable

from jax import Array
from jaxtyping import Float

Scalar = Float[Array, ""]
Real = Scalar | float | int  # an argument that may be a plain number
Vec2 = Float[Array, "2"]
Vec3 = Float[Array, "3"]
Mat2 = Float[Array, "2 2"]
Mat3 = Float[Array, "3 3"]
Turn = Callable[[Scalar], tuple[Scalar, Scalar]]  # (cos 2πu, sin 2πu): `_special.cos_sin_turn`, or a cheaper form
