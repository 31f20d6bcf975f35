"""Visible GGX normals through the cross-section of the hemisphere: the method of 2018 (dupuy2023 §2)."""

from ggxref import _special, stable
from ggxref._types import Turn, Vec2, Vec3
from ggxref.sampling._sphere import crescent, incident, unstretch
from ggxref.sampling._visible import pdf_ggx as pdf

__all__ = ["pdf", "sample"]


@stable.widened
def sample(u: Vec2, wi: Vec3, alpha: Vec2, *, turn: Turn = _special.cos_sin_turn) -> Vec3:
    """Stretch `wi`, draw a point of the hemisphere's silhouette, lift it to the hemisphere, unstretch.

    - `u`: in [0, 1)², (2,). `wi`: unit, (3,), anywhere but straight below. `alpha`: positive, (2,).
    - `turn`: the form of cos 2πu and sin 2πu.
    - Returns a micronormal with density `pdf`: unit, (3,), above the horizon.

    dupuy2023 listings 1 and 2 (Heitz 2018).
    """
    i = incident(alpha[0] * wi[0], alpha[1] * wi[1], wi[2])
    cos_phi, sin_phi = turn(u[0])
    r = stable.sqrt(u[1])
    across, along = r * cos_phi, r * sin_phi
    sin_theta = stable.sqrt(i.x * i.x + i.y * i.y)
    moved, lifted, z = crescent(along, 1 - u[1], i, sin_theta)
    # The listing's w1 = (-sin, cos, 0) and w2 = (-z cos, -z sin, sin_theta) in the azimuth of wi; w1 = x at the pole.
    cos_i, sin_i = stable.azimuth(i.x, i.y, pole=(0.0, -1.0))
    outward = lifted * sin_theta - moved * i.z
    return unstretch(cos_i * outward - sin_i * across, sin_i * outward + cos_i * across, z, alpha)
