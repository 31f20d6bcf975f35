"""The catalogue's entries for the samplers and their densities, and the table of all entries."""

from ggxref.golden.catalogue import Function, entry, gradient
from ggxref.golden.formulas import BSDF, ELLIPSOID, FRESNEL, GEOMETRY, JACOBIAN, MASKING, NDF, SLOPES

# Convention in all samplers: u[0] turns, u[1] reaches.
MAP = "The map from u to the normal is a convention; another map of the same law is no mistake. "
POLAR = MAP + "Here phi = 2 pi u[0]; "
TRIES = (
    "Row t of u is try t. The result is the first accepted normal and its number from 1; (0, 0, 0) and 0 if none is. "
)

_CAP = r"\phi = 2\pi u_0, z = (1-u_1)(1-\ell) + \ell, o' = (\sqrt{1-z^2}\cos\phi, \sqrt{1-z^2}\sin\phi, z)"
_VISIBLE = r"\max(\omega_i\cdot\omega_m, 0) D(\omega_m) / \sigma(\omega_i)"
_BOUND = r"k = (1-a^2)s^2 / (s^2 + a^2z_i^2), a = \min(\alpha_x, \alpha_y, 1), s = 1 + \|(x_i, y_i)\|; 1 for z_i \le 0"

NORMALS = [
    entry(
        "sampling.normals.sample_ggx(u, alpha)",
        16,
        r"\propto (\alpha_x\sqrt{u_1}\cos\phi, \alpha_y\sqrt{u_1}\sin\phi, \sqrt{1-u_1})",
        "Walter et al. 2007 (35)",
        note=POLAR + "u[1] = 0 is the normal.",
    ),
    entry(
        "sampling.normals.sample_beckmann(u, alpha)",
        18,
        r"\propto (\alpha_xr\cos\phi, \alpha_yr\sin\phi, 1), r = \sqrt{-\log(1-u_1)}",
        "Walter et al. 2007 (28)",
        note=POLAR + "u[1] = 0 is the normal.",
    ),
    entry("sampling.normals.pdf_ggx(wm, alpha)", 16, r"D(\omega_m)(\omega_m\cdot n), D of ndf.ggx", "heitz2014 (1)"),
    entry(
        "sampling.normals.pdf_beckmann(wm, alpha)",
        16,
        r"D(\omega_m)(\omega_m\cdot n), D of ndf.beckmann",
        "heitz2014 (1)",
    ),
]

_QUANTILES = (
    MAP
    + "In the stretched frame with wi' = (sin, 0, cos), u[0] is the quantile of the slope along wi' and u[1] that of "
    "the slope across it given the first, both counted from -infinity; turned by wi's azimuth, (1, 0) at normal incidence."
)
SLOPE = [
    entry(
        "sampling.slope_ggx.sample(u, wi, alpha)",
        40,
        r"C_{2-}(\tilde x) = u_0, C_{2|}(\tilde y | \tilde x) = u_1, turned and unstretched",
        "heitz2014 algorithm 4",
        note=_QUANTILES,
    ),
    entry("sampling.slope_ggx.pdf(wm, wi, alpha)", 28, _VISIBLE + ", D of ndf.ggx", "heitz2014 (5)"),
    entry(
        "sampling.slope_beckmann.sample(u, wi, alpha)",
        48,
        r"C_{2-}(\tilde x) = u_0, C_{2|}(\tilde y) = u_1, turned and unstretched",
        "heitz2014 algorithm 4",
        note=_QUANTILES,
    ),
    entry("sampling.slope_beckmann.pdf(wm, wi, alpha)", 34, _VISIBLE + ", D of ndf.beckmann", "heitz2014 (5)"),
]


def _cavity(distribution: str) -> list[Function]:
    options = {"distribution": distribution}
    return [
        entry(
            "sampling.v_cavity.sample(u=u3, wi, alpha)",
            20,
            r"m of D\cos by u_0, u_1, or m' = (-x, -y, z) if "
            r"u_2 < \langle\omega_i, m'\rangle / (\langle\omega_i, m\rangle + \langle\omega_i, m'\rangle)",
            "heitz2014 algorithm 3",
            note=MAP + f"m is that of sampling.normals.sample_{distribution}.",
            above=("wi",),
            options=options,
        ),
        entry(
            "sampling.v_cavity.pdf(wm, wi, alpha)",
            28,
            r"2\langle\omega_i, m\rangle / (\langle\omega_i, m\rangle + \langle\omega_i, m'\rangle) z_m D(m), "
            r"m' = (-x, -y, z); 0 for z_i \le 0",
            "heitz2014 appendix B",
            options=options,
        ),
    ]


CAPS = [
    entry(
        "sampling.cross_section.sample(u, wi, alpha)",
        32,
        r"disk of the projected hemisphere, lifted and unstretched",
        "dupuy2023 listings 1 (line 8 corrected) and 2",
        note=POLAR + "r = sqrt(u[1]); basis w1 = (-y, x, 0) normalised, (1, 0, 0) at normal incidence, w2 = wi' x w1.",
    ),
    entry("sampling.cross_section.pdf(wm, wi, alpha)", 28, _VISIBLE + ", D of ndf.ggx", "heitz2014 (5)"),
    entry(
        "sampling.spherical_cap.sample(u, wi, alpha)",
        32,
        _CAP + r", \ell = -z_{i'}, \omega_m \propto B(o' + i')",
        "dupuy2023 listings 1 (line 8 corrected) and 3",
        note=POLAR + "the lower u[1], the higher o'.",
    ),
    entry("sampling.spherical_cap.pdf(wm, wi, alpha)", 28, _VISIBLE + ", D of ndf.ggx", "dupuy2023 (1)-(4)"),
    entry(
        "sampling.spherical_cap.cap_pdf(wo, wi)",
        4,
        r"1 / (2\pi(1 + z_i)) where z_o > -z_i, else 0, both in sphere space",
        "dupuy2023 (10)",
    ),
    entry(
        "sampling.bounded_cap.sample(u, wi, alpha)",
        36,
        _CAP + r", \ell = -kz_{i'}, \omega_m \propto B(o' + i')",
        "tokuyoshi2024",
        note=POLAR + "the lower u[1], the higher o'.",
    ),
    entry(
        "sampling.bounded_cap.pdf(wm, wi, alpha)",
        36,
        r"2D(\omega_m)\max(\omega_i\cdot\omega_m, 0) / (kz_i + \|(\alpha_xx_i, \alpha_yy_i, z_i)\|); "
        r"0 where o'_z < -kz_{i'}",
        "tokuyoshi2024",
    ),
    entry("sampling.bounded_cap.bound(wi, alpha)", 16, _BOUND, "tokuyoshi2024"),
]

LUNE = [
    entry(
        "sampling.lune.sample(u, wi, A)",
        48,
        r"the unit disk compressed to the crescent that \omega_i sees, lifted to the sphere, \omega_m \propto A^Tp",
        "walter2014 (34)-(46)",
        note=MAP + "Here the concentric map of u; where wi = n, e1 and e2 are the rows t, b of geometry.basis(e3).",
    ),
    entry("sampling.lune.pdf(wm, wi, A)", 40, _VISIBLE + ", D of ndf.ellipsoid", "walter2014 (33)"),
    entry(
        "sampling.lune.sample_rejection_sphere(u=rows, wi, A)",
        64,
        r"rays along \omega_i through the bounding sphere's silhouette, until one meets the lune",
        "walter2014 §4.1, version 1",
        note=TRIES + "Disk: phi = 2 pi u[t,0], r = sqrt(u[t,1]); axes: the rows t, b of geometry.basis(wi).",
    ),
    entry(
        "sampling.lune.sample_rejection_ellipsoid(u=rows, wi, A)",
        48,
        r"points of the ellipsoid's silhouette, until one lies on the lune",
        "walter2014 §4.1, version 2",
        note=TRIES + "Disk: phi = 2 pi u[t,0], r = sqrt(u[t,1]); axes: the rows t, b of geometry.basis(A wi).",
    ),
]

ELLIPSOIDS = [
    entry(
        "sampling.ellipsoid_cap.sample(u, wi, A)",
        40,
        _CAP + r", \ell = -z_{i'}, i' = A\omega_i/\|A\omega_i\|, \omega_m \propto A^T(o' + i'), A made canonical",
        "ggxref: spherical caps for the ellipsoid NDF",
        note=POLAR + "the lower u[1], the higher o'.",
    ),
    entry(
        "sampling.ellipsoid_cap.pdf(wm, wi, A)",
        40,
        _VISIBLE + ", D of ndf.ellipsoid",
        "walter2014 (33)",
    ),
    entry(
        "sampling.ellipsoid_bounded.sample(u, wi, A)",
        48,
        _CAP
        + r", \ell = bound(\omega_i, A), i' = A\omega_i/\|A\omega_i\|, \omega_m \propto A^T(o' + i'), A made canonical",
        "ggxref: bounded caps for the ellipsoid NDF",
        note=POLAR + "the lower u[1], the higher o'. A tighter bound that is safe is no mistake.",
    ),
    entry(
        "sampling.ellipsoid_bounded.pdf(wm, wi, A)",
        48,
        r"uniform on the cap o'_z \ge bound(\omega_i, A), times the Jacobians of o' \mapsto \omega_m; 0 outside",
        "ggxref: bounded caps for the ellipsoid NDF",
    ),
    entry(
        "sampling.ellipsoid_bounded.bound(wi, A)",
        40,
        r"i_z/(\|A\omega_i\|Q) - i'_z, Q = \max_{0\le t\le t_1} \cos^2t + (\sin t + \|e\|\cos t)^2/c^2, "
        r"t_1 = (\theta_i + \pi/2)/2, c the smallest singular value of C; -i'_z for i_z \le 0",
        "ggxref: bounded caps for the ellipsoid NDF",
        note="A convention: any lower end that loses no direction above the horizon is right.",
    ),
]

_ALL = [
    *(GEOMETRY + JACOBIAN + ELLIPSOID + SLOPES + NDF + MASKING + FRESNEL + NORMALS + SLOPE),
    *(_cavity("ggx") + _cavity("beckmann") + CAPS + LUNE + ELLIPSOIDS + BSDF),
]
_GRADIENTS = {
    "ndf.ggx": ("wm", "alpha"),
    "ndf.beckmann": ("wm", "alpha"),
    "ndf.student_t": ("wm", "alpha"),
    "ndf.ellipsoid": ("wm", "A"),
    "masking.g1_ggx": ("alpha",),
    "masking.g1_beckmann": ("alpha",),
    "masking.g1_v_cavity": ("wm",),
    "masking.g1_ellipsoid": ("A",),
    "sampling.normals.pdf_ggx": ("wm", "alpha"),
    "sampling.normals.pdf_beckmann": ("wm", "alpha"),
    "sampling.slope_beckmann.pdf": ("wm", "alpha"),
    "sampling.v_cavity.pdf.ggx": ("wm", "alpha"),
    "sampling.v_cavity.pdf.beckmann": ("wm", "alpha"),
    "sampling.spherical_cap.pdf": ("wm", "alpha"),
    "sampling.bounded_cap.pdf": ("wm", "alpha"),
    "sampling.lune.pdf": ("wm", "A"),
    "sampling.ellipsoid_bounded.pdf": ("wm", "A"),
}
_ALL += [gradient(f, argument) for f in _ALL for argument in _GRADIENTS.get(f.id, ())]
FUNCTIONS: dict[str, Function] = {function.id: function for function in _ALL}
