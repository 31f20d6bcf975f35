"""The same quantity by other forms: as the documents print it, as renderers compute it, as production approximates it.

The library has one form of each; every other lives here, under a name and with its source. All are one-point functions.
"""

from collections.abc import Callable
from dataclasses import dataclass

from ggxref.measure.variants import brdf, densities, directions, masking, ndf
from ggxref.measure.variants.form import Variant


@dataclass(frozen=True)
class Quantity:
    """A quantity, the reference that grades it, and its forms; the first is the library's.

    `isotropic`: some form knows one α only, so all are compared at αx = αy.
    """

    name: str
    label: str
    reference: Callable
    variants: tuple[Variant, ...]
    isotropic: bool = False


QUANTITIES = {
    q.name: q
    for q in (
        Quantity("ndf", "$D$", ndf.exact, ndf.VARIANTS, isotropic=True),
        Quantity("lambda", "$\\Lambda$", masking.exact_lambda, masking.LAMBDA),
        Quantity("g1", "$G_1$", masking.exact_g1, masking.G1, isotropic=True),
        Quantity("g2", "$G_2$", masking.exact_g2, masking.G2, isotropic=True),
        Quantity("pdf", "visible-normal density", densities.exact_pdf, densities.PDF),
        Quantity("dot", "$\\omega_i\\cdot\\omega_m$", densities.exact_dot, densities.DOT),
        Quantity("fresnel", "$F$ (dielectric)", densities.exact_fresnel, densities.FRESNEL),
        Quantity("half", "$\\omega_h$", brdf.exact_half, brdf.HALF),
        Quantity("brdf", "$D G_2 F / 4 z_i z_o$ (conductor)", brdf.exact_brdf, brdf.BRDF),
        Quantity("turn", "$(\\cos 2\\pi u, \\sin 2\\pi u)$", directions.exact_turn, directions.TURN),
        Quantity("cap", "cap sampler", directions.exact_cap, directions.CAP),
        Quantity("cross_section", "cross-section sampler", directions.exact_cross_section, directions.CROSS_SECTION),
    )
}

__all__ = ["QUANTITIES", "Quantity", "Variant"]
