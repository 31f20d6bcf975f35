"""The catalogue's entries, but for the samplers."""

from ggxref.golden.catalogue import entry

GEOMETRY = [
    entry("geometry.reflect(w=wi, wm)", 6, r"2(\omega\cdot\omega_m)\omega_m - \omega", "dupuy2023 (5)"),
    entry(
        "geometry.refract(w=wi, wm, eta)",
        14,
        r"(\eta c - \mathrm{sgn}(c)\sqrt{1 + \eta^2(c^2-1)})\omega_m - \eta\omega, c = \omega\cdot\omega_m; "
        r"0 in total reflection",
        "heitz2014 §2.2",
    ),
    entry(
        "geometry.half_reflection(wi, wo)",
        8,
        r"(\omega_i + \omega_o) / \|\omega_i + \omega_o\|; 0 where \omega_i = -\omega_o",
        "dupuy2023 (6)",
    ),
    entry(
        "geometry.half_refraction(wi, wo, n_i, n_o)",
        10,
        r"\pm(n_i\omega_i + n_o\omega_o) / \|n_i\omega_i + n_o\omega_o\| with z \ge 0; 0 where the sum vanishes",
        "Walter et al. 2007 (16)",
    ),
    entry(
        "geometry.basis(w=wi)",
        8,
        r"rows t, b, \omega: s = \pm1 as z \ge 0 or not, a = -1/(s+z), t = (1 + sx^2a, sxya, -sx), b = (xya, s + y^2a, -y)",
        "Duff et al. 2017",
        note="Which t and b is a convention.",
    ),
]

JACOBIAN = [
    entry("jacobian.reflection(wo, wm)", 6, r"1 / (4|\omega_o\cdot\omega_m|)", "heitz2014 §2.2; dupuy2023 (8)"),
    entry(
        "jacobian.refraction(wi, wo, wm, n_i, n_o)",
        16,
        r"n_o^2|\omega_o\cdot\omega_m| / (n_i\omega_i\cdot\omega_m + n_o\omega_o\cdot\omega_m)^2",
        "heitz2014 §2.2",
    ),
    entry("jacobian.slope(wm)", 4, r"1 / (\omega_m\cdot n)^3", "heitz2014 §5.1", above=("wm",)),
    entry("jacobian.linear(wm, M=A)", 24, r"|\det M| / \|M\omega_m\|^3", "dupuy2023 (1)"),
]

ELLIPSOID = [
    entry(
        "ellipsoid.shape_matrix(alpha, angles)",
        10,
        r"A = \mathrm{diag}(\alpha_x, \alpha_y, 1) R_x(\theta_x) R_y(\theta_y) R_z(\theta_z)",
        "walter2014 (2), (3)",
    ),
    entry(
        "ellipsoid.canonical(A)",
        24,
        r"\begin{pmatrix} C^T & 0 \\ e^T & 1 \end{pmatrix}, S = A^TA/\|An\|^2, e = S_{:2,2}, CC^T = S_{:2,:2} - ee^T",
        "ggxref: canonical form",
    ),
    entry(
        "ellipsoid.from_slopes(mean, scatter)",
        8,
        r"\begin{pmatrix} C^T & 0 \\ -\mu^T & 1 \end{pmatrix}, CC^T = \Sigma",
        "ggxref: canonical form",
    ),
    entry(
        "ellipsoid.to_slopes(A)",
        32,
        r"(-e, \Sigma), S = A^TA/\|An\|^2, e = S_{:2,2}, \Sigma = S_{:2,:2} - ee^T",
        "ggxref: canonical form",
    ),
    entry("ellipsoid.sggx(A)", 4, r"S = A^TA", "walter2014 §5.2"),
    entry("ellipsoid.size(A)", 12, r"C_e = \sqrt{|\det A| / (\pi\|An\|)}", "walter2014 (29)"),
    entry("ellipsoid.gaussian_curvature(wm, A, size)", 24, r"|A|^2\|A^{-T}\omega_m\|^4 / C_e^2", "walter2014 (20)"),
    entry("ellipsoid.projected_area(w=wi, A, size)", 14, r"\pi C_e^2 \|A\omega\| / |\det A|", "walter2014 (26)"),
    entry(
        "ellipsoid.lune_area(u=wi, v=wo, A, size)",
        24,
        r"\pi C_e^2 (\|Au\|\|Av\| + Au\cdot Av) / (2|\det A|\|Av\|)",
        "walter2014 (28)",
    ),
    entry("ellipsoid.mean_normal(A)", 14, r"A^TAn / \|A^TAn\|", "walter2014 §5.1"),
]

_P = r"\tilde x^2/\alpha_x^2 + \tilde y^2/\alpha_y^2"
SLOPES = [
    entry("slopes.from_normal(wm)", 2, r"(-x/z, -y/z)", "heitz2014 §5.1", above=("wm",)),
    entry("slopes.to_normal(slope)", 6, r"(-\tilde x, -\tilde y, 1) / \|\cdot\|", "heitz2014 §5.1"),
    entry("slopes.stretch(w=wi, factors=alpha)", 8, r"(\lambda_xx, \lambda_yy, z) / \|\cdot\|", "heitz2014 §5.2"),
    entry("slopes.ggx(slope, alpha)", 12, rf"P^{{22}} = 1 / (\pi\alpha_x\alpha_y(1 + {_P})^2)", "heitz2014 §5"),
    entry("slopes.beckmann(slope, alpha)", 12, rf"P^{{22}} = \exp(-({_P})) / (\pi\alpha_x\alpha_y)", "heitz2014 §5"),
    entry(
        "slopes.student_t(slope, alpha, gamma)",
        20,
        rf"P^{{22}} = (\gamma-1)^\gamma / (\pi\alpha_x\alpha_y (\gamma-1+{_P})^\gamma)",
        "Ribardière et al. 2017",
    ),
    entry(
        "slopes.ellipsoid(slope, A)",
        32,
        r"P^{22} = 1 / (\pi|A|\|An\|\|A^{-T}(-\tilde x, -\tilde y, 1)\|^4)",
        "walter2014 (1)",
    ),
    entry(
        "slopes.visible_ggx(slope, wi, alpha)",
        24,
        r"\max(0, -x_i\tilde x - y_i\tilde y + z_i) P^{22} / \sigma(\omega_i)",
        "heitz2014 (7)",
    ),
    entry(
        "slopes.visible_beckmann(slope, wi, alpha)",
        32,
        r"\max(0, -x_i\tilde x - y_i\tilde y + z_i) P^{22} / \sigma(\omega_i)",
        "heitz2014 (7)",
    ),
]

_CHI = r"\chi^+(\omega_m\cdot n)"
_Q = r"x^2/\alpha_x^2 + y^2/\alpha_y^2"
NDF = [
    entry("ndf.hemisphere(wm)", 1, rf"D = {_CHI} / \pi", "dupuy2023 (3)"),
    entry("ndf.ggx(wm, alpha)", 14, rf"D = {_CHI} / (\pi\alpha_x\alpha_y({_Q} + z^2)^2)", "dupuy2023 (12)"),
    entry(
        "ndf.beckmann(wm, alpha)",
        14,
        rf"D = {_CHI} \exp(-({_Q})/z^2) / (\pi\alpha_x\alpha_yz^4)",
        "heitz2014 §5.1",
    ),
    entry(
        "ndf.student_t(wm, alpha, gamma)",
        20,
        rf"D = {_CHI} (\gamma-1)^\gamma / (\pi\alpha_x\alpha_yz^4(\gamma-1+({_Q})/z^2)^\gamma)",
        "Ribardière et al. 2017",
    ),
    entry("ndf.ellipsoid(wm, A)", 24, rf"D = {_CHI} / (\pi|A|\|An\|\|A^{{-T}}\omega_m\|^4)", "walter2014 (1)"),
]

_FRONT = r"\chi^+((\omega\cdot\omega_m)(\omega\cdot n))"
MASKING = [
    entry(
        "masking.lambda_ggx(w=wi, alpha)",
        12,
        r"\Lambda = (-1 + \sqrt{1 + (\alpha_x^2x^2 + \alpha_y^2y^2)/z^2}) / 2",
        "tokuyoshi2024",
    ),
    entry(
        "masking.lambda_beckmann(w=wi, alpha)",
        16,
        r"\Lambda = (\mathrm{erf}(a) - 1)/2 + e^{-a^2}/(2a\sqrt\pi), a = |z| / \|(\alpha_xx, \alpha_yy)\|",
        "Smith 1967",
    ),
    entry("masking.g1_ggx(w=wi, wm, alpha)", 12, rf"G_1 = {_FRONT} / (1 + \Lambda(\omega))", "dupuy2023 (15)"),
    entry("masking.g1_beckmann(w=wi, wm, alpha)", 16, rf"G_1 = {_FRONT} / (1 + \Lambda(\omega))", "heitz2014 §2.1"),
    entry(
        "masking.g1_v_cavity(w=wi, wm)",
        8,
        rf"G_1 = {_FRONT} \min(1, 2|\omega_m\cdot n||\omega\cdot n|/|\omega\cdot\omega_m|)",
        "heitz2014 (3)",
    ),
    entry(
        "masking.g1_ellipsoid(w=wi, wm, A)",
        24,
        rf"G_1 = {_FRONT} \min(1, 2\|An\|^2|\omega\cdot n| / (\|Au\|\|An\| + Au\cdot An)), u = \pm\omega, u\cdot n > 0",
        "walter2014 (6), (7)",
    ),
    entry("masking.g2_separable(g1_i, g1_o)", 1, r"G_2 = G_iG_o", "heitz2014 §2.1; walter2014 (5)"),
    entry("masking.g2_height_correlated(g1_i, g1_o)", 5, r"G_2 = G_iG_o / (G_i + G_o - G_iG_o)", "dupuy2023 (13)"),
    entry(
        "masking.g2_v_cavity(wi, wo, wm)",
        9,
        r"G_2 = \min(G_1(\omega_i), G_1(\omega_o)) for \omega_o\cdot n > 0, else \max(G_1(\omega_i) + G_1(\omega_o) - 1, 0)",
        "heitz2014 §2.1",
        above=("wi", "wm"),
    ),
]

FRESNEL = [
    entry(
        "fresnel.dielectric(cos_i, eta)",
        20,
        r"F = (R_s^2 + R_p^2)/2, R_s = (\eta c - c_t)/(\eta c + c_t), R_p = (c - \eta c_t)/(c + \eta c_t), "
        r"c_t = \sqrt{1 - \eta^2(1 - c^2)}; 1 in total reflection, 0 at \eta = 1",
        "Walter et al. 2007 (22)",
    ),
    entry(
        "fresnel.conductor(cos_i, eta, k)",
        24,
        r"F = (|R_s|^2 + |R_p|^2)/2 of the metal's index \eta + ik = n_o/n_i",
        "heitz2014 §2.1",
    ),
    entry("fresnel.schlick(cos_i, f0)", 8, r"F_0 + (1 - F_0)(1 - |c|)^5", "Schlick 1994"),
]

BSDF = [
    entry("bsdf.brdf(wi, wo, D, G2, F)", 6, r"DG_2F / (4|\omega_i\cdot n||\omega_o\cdot n|)", "walter2014 (4)"),
    entry(
        "bsdf.brdf_ggx(wi, wo, alpha)",
        30,
        r"DG_2 / (4|\omega_i\cdot n||\omega_o\cdot n|) of GGX with height-correlated masking at \omega_h; "
        r"0 unless both are above the horizon",
        "walter2014 (4); dupuy2023 (13)",
    ),
    entry(
        "bsdf.btdf(wi, wo, n_i, n_o, D, G2, F)",
        32,
        r"|\omega_i\cdot\omega_h||\omega_o\cdot\omega_h| n_o^2(1-F)G_2D / "
        r"(|\omega_i\cdot n||\omega_o\cdot n|(n_i\omega_i\cdot\omega_h + n_o\omega_o\cdot\omega_h)^2)",
        "heitz2014 §2.1",
    ),
    entry(
        "bsdf.weight_normals(wi, wm, G2)",
        8,
        r"|\omega_i\cdot\omega_m|G_2 / (|\omega_i\cdot n||\omega_m\cdot n|)",
        "heitz2014 algorithm 1",
    ),
    entry("bsdf.weight_visible(g1_i, g2=g1_o, F)", 3, r"FG_2/G_1(\omega_i); 0 where G_1 = 0", "heitz2014 algorithm 2"),
]
