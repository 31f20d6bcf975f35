"""Random points at which the public functions are measured: what a renderer draws, and the regions where formulas fail."""

from collections.abc import Callable

import numpy as np
from numpy.random import Generator

Points = dict[str, np.ndarray]

# Function -> argument -> quantity of `quantities`; an argument alone is drawn as the quantity of its own name.
_SIGNATURES = """
geometry.reflect(w=wi, wm)
geometry.refract(w=wi, wm, eta)
geometry.half_reflection(wi, wo)
geometry.half_refraction(wi, wo, n_i, n_o)
geometry.basis(w=wi)
jacobian.reflection(wo, wm)
jacobian.refraction(wi, wo, wm, n_i, n_o)
jacobian.slope(wm=wm_up)
jacobian.linear(wm, M=A)
ellipsoid.shape_matrix(alpha, angles)
ellipsoid.canonical(A)
ellipsoid.from_slopes(mean, scatter)
ellipsoid.to_slopes(A)
ellipsoid.sggx(A)
ellipsoid.size(A)
ellipsoid.gaussian_curvature(wm=wm_A, A, size)
ellipsoid.projected_area(w=wi, A, size)
ellipsoid.lune_area(u=wi, v=wo, A, size)
ellipsoid.mean_normal(A)
slopes.from_normal(wm=wm_up)
slopes.to_normal(slope)
slopes.stretch(w=wi, factors=alpha)
slopes.ggx(slope, alpha)
slopes.beckmann(slope, alpha)
slopes.student_t(slope, alpha, gamma)
slopes.ellipsoid(slope=slope_A, A)
slopes.visible_ggx(slope, wi, alpha)
slopes.visible_beckmann(slope, wi=wi_seeing, alpha)
ndf.hemisphere(wm)
ndf.ggx(wm, alpha)
ndf.beckmann(wm, alpha)
ndf.student_t(wm, alpha, gamma)
ndf.ellipsoid(wm=wm_A, A)
masking.lambda_ggx(w=wi, alpha)
masking.lambda_beckmann(w=wi, alpha)
masking.g1_ggx(w=wi, wm, alpha)
masking.g1_beckmann(w=wi, wm, alpha)
masking.g1_v_cavity(w=wi, wm)
masking.g1_ellipsoid(w=wi, wm=wm_A, A)
masking.g2_separable(g1_i, g1_o)
masking.g2_height_correlated(g1_i, g1_o)
masking.g2_v_cavity(wi=wi_up, wo, wm=wm_up)
fresnel.dielectric(cos_i, eta)
fresnel.conductor(cos_i, eta, k)
fresnel.schlick(cos_i, f0)
bsdf.brdf(wi, wo, D, G2, F)
bsdf.brdf_ggx(wi=wi_up, wo, alpha)
bsdf.btdf(wi, wo, n_i, n_o, D, G2, F)
bsdf.weight_normals(wi, wm=wm_up, G2)
bsdf.weight_visible(g1_i, g2=G2, F)
sampling.normals.sample_ggx(u, alpha)
sampling.normals.sample_beckmann(u, alpha)
sampling.normals.pdf_ggx(wm, alpha)
sampling.normals.pdf_beckmann(wm, alpha)
sampling.slope_ggx.sample(u, wi, alpha)
sampling.slope_ggx.pdf(wm, wi, alpha)
sampling.slope_beckmann.sample(u, wi=wi_seeing, alpha)
sampling.slope_beckmann.pdf(wm, wi=wi_seeing, alpha)
sampling.v_cavity.sample(u=u3, wi=wi_up, alpha)
sampling.v_cavity.pdf(wm, wi, alpha)
sampling.cross_section.sample(u, wi, alpha)
sampling.cross_section.pdf(wm, wi, alpha)
sampling.spherical_cap.sample(u, wi, alpha)
sampling.spherical_cap.pdf(wm, wi, alpha)
sampling.spherical_cap.cap_pdf(wo=w, wi)
sampling.bounded_cap.sample(u, wi, alpha)
sampling.bounded_cap.pdf(wm, wi, alpha)
sampling.bounded_cap.bound(wi, alpha)
sampling.lune.sample(u, wi, A)
sampling.lune.pdf(wm=wm_A, wi, A)
sampling.lune.sample_rejection_sphere(u=rows, wi, A)
sampling.lune.sample_rejection_ellipsoid(u=rows, wi, A)
sampling.ellipsoid_cap.sample(u, wi, A)
sampling.ellipsoid_cap.pdf(wm=wm_A, wi, A)
sampling.ellipsoid_bounded.sample(u, wi, A)
sampling.ellipsoid_bounded.pdf(wm=wm_A, wi, A)
sampling.ellipsoid_bounded.bound(wi, A)
"""


def _parse(line: str) -> tuple[str, dict[str, str]]:
    name, _, arguments = line.rstrip(")").partition("(")
    pairs = (argument.partition("=") for argument in arguments.split(", "))
    return name, {key: quantity or key for key, _, quantity in pairs}


FUNCTIONS = dict(_parse(line) for line in _SIGNATURES.strip().splitlines())


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def log_uniform(rng: Generator, low: float, high: float, shape) -> np.ndarray:
    return np.exp(rng.uniform(np.log(low), np.log(high), shape))


def mixture(rng: Generator, n: int, kinds: list[tuple[float, Callable[[], np.ndarray]]]) -> np.ndarray:
    """`n` rows, each from one of the sources in proportion to its weight."""
    weights = np.array([weight for weight, _ in kinds])
    which = rng.choice(len(kinds), size=n, p=weights / weights.sum())
    drawn = np.stack([source() for _, source in kinds])
    return drawn[which, np.arange(n)]


def _polar(sin_theta, cos_theta, phi):
    return np.stack([sin_theta * np.cos(phi), sin_theta * np.sin(phi), cos_theta], axis=-1)


class _Directions:
    """Directions of light, view and micronormal: over the sphere, and where formulas fail."""

    def __init__(self, rng: Generator, n: int):
        self.rng, self.n = rng, n

    def _turn(self):
        return self.rng.uniform(0, 2 * np.pi, self.n)

    def _sign(self):
        return self.rng.choice([-1.0, 1.0], self.n)

    def sphere(self):
        return unit(self.rng.normal(size=(self.n, 3)))

    def grazing(self):
        z = log_uniform(self.rng, 1e-6, 0.1, self.n) * self._sign()
        return _polar(np.sqrt(1 - z * z), z, self._turn())

    def polar(self):
        theta = log_uniform(self.rng, 1e-7, 0.1, self.n)
        return _polar(np.sin(theta), np.cos(theta) * self._sign(), self._turn())

    def normal(self):
        return np.tile([0.0, 0.0, 1.0], (self.n, 1))

    def horizon(self):
        return _polar(1.0, np.zeros(self.n), self._turn())

    def anywhere(self):
        return mixture(
            self.rng,
            self.n,
            [(8, self.sphere), (4, self.grazing), (3, self.polar), (0.5, self.normal), (0.5, self.horizon)],
        )

    def micronormal(self, slope, wi):
        """In the lobe of the slopes given, over the sphere, nearly perpendicular to `wi`, grazing, or n."""

        def edge_on():
            across = unit(np.cross(wi, self.sphere()))
            m = across + log_uniform(self.rng, 1e-9, 0.1, (self.n, 1)) * self._sign()[:, None] * wi
            return unit(m * np.where(m[:, 2:] < 0, -1, 1))

        def lobe():
            return unit(np.concatenate([-slope, np.ones((self.n, 1))], axis=-1))

        return mixture(
            self.rng, self.n, [(8, lobe), (3, self.sphere), (3, edge_on), (2, self.grazing), (0.5, self.normal)]
        )

    def outgoing(self, wi, wm, eta):
        """Reflected, refracted, nearly straight on, or anywhere."""
        c = np.sum(wi * wm, axis=-1, keepdims=True)
        reflected = 2 * c * wm - wi
        ratio = eta[:, None]
        radicand = 1 + ratio**2 * (c * c - 1)
        along = ratio * c - np.sign(c) * np.sqrt(np.abs(radicand))
        refracted = np.where(radicand > 0, unit(along * wm - ratio * wi), reflected)
        straight = unit(-wi + log_uniform(self.rng, 1e-7, 0.1, (self.n, 1)) * self.sphere())
        return mixture(
            self.rng,
            self.n,
            [(4, lambda: reflected), (4, lambda: refracted), (1, lambda: straight), (4, self.anywhere)],
        )


def _numbers(rng, *shape):
    """In [0, 1): uniform, one in eight towards an end, one in thirty 0 or 1 (rounded down later)."""
    plain = rng.uniform(size=shape)
    tail = log_uniform(rng, 1e-12, 0.1, shape)
    tail = np.where(rng.uniform(size=shape) < 0.5, tail, 1 - tail)
    u = np.where(rng.uniform(size=shape) < 0.12, tail, plain)
    return np.where(rng.uniform(size=shape) < 0.03, rng.choice([0.0, 1.0], shape), u)


def _share(rng, n):
    """In [0, 1], with the ends, and small ones as at grazing."""
    return mixture(
        rng,
        n,
        [
            (8, lambda: rng.uniform(size=n)),
            (3, lambda: log_uniform(rng, 1e-6, 1, n)),
            (0.5, lambda: np.zeros(n)),
            (0.5, lambda: np.ones(n)),
        ],
    )


def _rotation(rng, n):
    q, r = np.linalg.qr(rng.normal(size=(n, 3, 3)))
    return q * np.sign(np.einsum("nii->ni", r))[:, None, :]


def quantities(rng: Generator, n: int) -> Points:
    """`n` points of every quantity that a public function takes, in float64."""
    alpha_x = log_uniform(rng, 1e-4, 2, n)
    alpha_y = np.clip(
        alpha_x * mixture(rng, n, [(1, lambda: np.ones(n)), (3, lambda: log_uniform(rng, 1e-3, 1e3, n))]), 1e-4, 2
    )
    alpha = np.stack([alpha_x, alpha_y], axis=-1)

    # A = c Q C', C' canonical: C the Cholesky factor of the scatter, e minus the mean slope, from straight to strongly skewed.
    phi = rng.uniform(0, np.pi, n)
    turn = np.stack([np.cos(phi), -np.sin(phi), np.sin(phi), np.cos(phi)], axis=-1).reshape(n, 2, 2)
    scatter = np.einsum("nij,nj,nkj->nik", turn, alpha**2, turn)
    scatter[:, 1, 0] = scatter[:, 0, 1]
    skew = mixture(rng, n, [(1, lambda: np.zeros(n)), (8, lambda: log_uniform(rng, 1e-3, 5, n))])
    azimuth = rng.uniform(0, 2 * np.pi, n)
    mean = skew[:, None] * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
    root = turn * alpha[:, None, :]  # root rootᵀ = scatter, as C Cᵀ
    canonical = np.zeros((n, 3, 3))
    canonical[:, :2, :2] = np.swapaxes(root, 1, 2)
    canonical[:, 2, :2], canonical[:, 2, 2] = -mean, 1
    A = log_uniform(rng, 0.1, 10, (n, 1, 1)) * _rotation(rng, n) @ canonical

    reach = log_uniform(rng, 1e-3, 1e3, (n, 1))
    around = rng.uniform(0, 2 * np.pi, n)
    circle = reach * np.stack([np.cos(around), np.sin(around)], axis=-1)
    slope, slope_A = alpha * circle, mean + np.einsum("nij,nj->ni", root, circle)

    directions = _Directions(rng, n)
    eta = mixture(
        rng,
        n,
        [
            (6, lambda: log_uniform(rng, 0.3, 3, n)),
            (2, lambda: 1 + log_uniform(rng, 1e-6, 0.1, n) * rng.choice([-1, 1], n)),
            (0.5, lambda: np.ones(n)),
        ],
    )
    n_o = rng.uniform(1, 2.5, n)
    wi = directions.anywhere()
    wm, wm_A = directions.micronormal(slope, wi), directions.micronormal(slope_A, wi)
    critical = np.sqrt(np.maximum(1 - 1 / eta**2, 0))
    near_critical = critical * (1 + log_uniform(rng, 1e-9, 0.1, n) * rng.choice([-1, 1], n))
    up = np.array([1.0, 1.0, -1.0])
    return {
        "alpha": alpha,
        "A": A,
        "mean": mean,
        "scatter": scatter,
        "angles": rng.uniform(-3, 3, (n, 3)),
        "size": log_uniform(rng, 0.25, 4, n),
        "wi": wi,
        "wi_up": np.where(wi[:, 2:] < 0, wi * up, np.where(wi[:, 2:] == 0, [0.0, 0.0, 1.0], wi)),
        # Below this the area that a Beckmann surface shows underflows in float32 (the density there is 0, by convention).
        "wi_seeing": np.where(wi[:, 2:] < -8 * np.linalg.norm(alpha * wi[:, :2], axis=-1, keepdims=True), wi * up, wi),
        "wm": wm,
        "wm_up": np.where(wm[:, 2:] < 0, wm * up, wm),
        "wm_A": wm_A,
        "w": directions.anywhere(),
        "wo": directions.outgoing(wi, wm, eta),
        "slope": slope,
        "slope_A": slope_A,
        "u": _numbers(rng, n, 2),
        "u3": _numbers(rng, n, 3),
        "rows": _numbers(rng, n, 8, 2),
        "eta": eta,
        "n_i": n_o * eta,
        "n_o": n_o,
        "cos_i": np.clip(
            mixture(
                rng, n, [(4, lambda: rng.uniform(-1, 1, n)), (2, lambda: near_critical), (1, lambda: _share(rng, n))]
            ),
            -1,
            1,
        ),
        "k": mixture(rng, n, [(4, lambda: log_uniform(rng, 0.01, 8, n)), (1, lambda: np.zeros(n))]),
        "f0": _share(rng, n),
        "gamma": 1 + log_uniform(rng, 0.1, 100, n),
        "g1_i": _share(rng, n),
        "g1_o": _share(rng, n),
        "G2": _share(rng, n),
        "F": _share(rng, n),
        "D": log_uniform(rng, 1e-4, 1e7, n),
    }


_UNIFORM = frozenset({"u", "u3", "rows"})


def points(function: str, n: int, seed: int, dtype: type = np.float64) -> Points:
    """Inputs of the public function of that dotted name, by argument, `n` rows each, rounded to `dtype`."""
    arguments = FUNCTIONS[function]
    drawn = quantities(np.random.default_rng([seed, *function.encode()]), n)
    below_1 = 1 - np.finfo(np.float64 if dtype == np.float64 else np.float32).epsneg
    inputs = {}
    for argument, quantity in arguments.items():
        x = drawn[quantity]
        inputs[argument] = (np.minimum(x, below_1) if quantity in _UNIFORM else x).astype(dtype)
    return inputs
