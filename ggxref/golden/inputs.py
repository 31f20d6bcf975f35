"""What a test is drawn from: a surface, directions, numbers and indices, each in the variant that a theme asks for.

Everything is exact (fractions of integers from a `Stream`), so the same bits come out everywhere. Directions are unit
only until they are rounded to the dtype.
"""

from collections.abc import Mapping
from functools import cached_property

from flint import fmpq

from ggxref.golden.linear import (
    ONE,
    ZERO,
    Matrix,
    N,
    Vector,
    combination,
    cross,
    dot,
    minus,
    product,
    times,
    transposed,
)
from ggxref.golden.rounding import Format
from ggxref.golden.stream import Stream, hemisphere, root, unit


def direction(s: Stream, fmt: Format, variant: str) -> Vector:
    """A direction; the variant says how far from the normal, and on which side."""
    x, y = s.circle()
    small = s.scale(fmpq(1, 2**14), fmpq(1, 2**5))
    match variant:
        case "normal":
            return N
        case "nadir":
            return minus(N)
        case "near":
            return unit(x * small, y * small, ONE)
        case "subnormal":
            tiny = fmpq(2) ** (fmt.quantum + 2 + s.below(fmt.precision - 3))
            return x * tiny, y * tiny, ONE
        case "grazing":
            return unit(x, y, small)
        case "grazing below":
            return unit(x, y, -small)
        case "horizon":
            return x, y, ZERO
        case "below":
            return minus(hemisphere(s))
    return hemisphere(s)


def roughness(s: Stream, variant: str) -> tuple[fmpq, fmpq]:
    """(alpha_x, alpha_y)."""
    a, b = s.scale(fmpq(1, 50), 1), s.scale(fmpq(1, 50), 1)
    match variant:
        case "small":
            a, b = s.scale(fmpq(1, 10**4), fmpq(1, 10**3)), s.scale(fmpq(1, 10**4), fmpq(1, 10**3))
        case "isotropic":
            b = a
        case "isotropic small":
            a = b = s.scale(fmpq(1, 10**4), fmpq(1, 10**3))
        case "one":
            a, b = ONE, ONE
        case "above one":
            a, b = s.uniform(1, 2), s.scale(fmpq(1, 4), 2)
        case "mild":
            a = b * s.uniform(fmpq(5, 4), 4)
        case "extreme":
            a = s.uniform(fmpq(1, 5), 2)
            b = a / s.uniform(500, 1000)
    return (a, b) if s.bits(1) else (b, a)


def canonical(s: Stream, alpha: tuple[fmpq, fmpq], variant: str) -> Matrix:
    """A canonical shape matrix: rows (C00, C10, 0), (0, C11, 0), (ex, ey, 1)."""
    x, y = s.circle()
    shear = s.uniform(-1, 1) * min(alpha)
    skew = {"aligned": ZERO, "skew": s.uniform(fmpq(1, 20), 1), "strong": s.uniform(1, 4)}.get(
        variant, s.uniform(0, fmpq(1, 4))
    )
    if variant == "aligned":
        shear = ZERO
    return (alpha[0], shear, ZERO), (ZERO, alpha[1], ZERO), (skew * x, skew * y, ONE)


def rotation(s: Stream) -> Matrix:
    """A rational rotation, from a quaternion of small integers."""
    a, b, c, d = 1 + s.below(8), s.below(17) - 8, s.below(17) - 8, s.below(17) - 8
    n = a * a + b * b + c * c + d * d
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = (
        (a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)),
        (2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)),
        (2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d),
    )
    over = fmpq(1, n)
    return (xx * over, xy * over, xz * over), (yx * over, yy * over, yz * over), (zx * over, zy * over, zz * over)


def general(s: Stream, A: Matrix, variant: str) -> Matrix:
    """Another matrix of the same distribution, c Q A; for `negative` one with a negative determinant."""
    if variant == "aligned":
        return A
    Q, c = rotation(s), s.scale(fmpq(1, 2), 2)
    x, y, z = product((Q[0], Q[1], minus(Q[2])) if variant == "negative" else Q, A)
    return combination(c, x, ZERO, x), combination(c, y, ZERO, y), combination(c, z, ZERO, z)


def micronormal(s: Stream, fmt: Format, A: Matrix, wi: Vector, eta: fmpq, variant: str) -> Vector:
    """A normal of the ellipsoid of canonical `A`, by default one of the visible ones that a renderer meets."""
    match variant:
        case "critical" if eta > 1:
            cos = cosine(s, eta, "critical")
            return combination(cos, wi, root(1 - cos * cos), unit(*cross(wi, hemisphere(s))))
        case "near" | "grazing" | "horizon" | "below" | "normal" | "subnormal":
            return direction(s, fmt, variant)
        case "perpendicular":
            p = unit(*cross(wi, hemisphere(s)))
            tilt = s.scale(fmpq(1, 2**14), fmpq(1, 2**7)) * s.sign()
            return unit(*combination(ONE, p if p[2] > 0 else minus(p), tilt, wi))
        case "tail":
            x, y = s.circle()
            far = s.uniform(10, 30)
            return unit(*times(transposed(A), (far * x, far * y, ONE)))
    back = variant == "wrong side"
    m = N
    for _ in range(32):  # a plain draw succeeds at once; the others may have no such normal
        m = times(transposed(A), hemisphere(s))
        if back:
            m = hemisphere(s)
        if m[2] > 0 and (dot(wi, m) < 0) == back:
            break
    return unit(m[0], m[1], abs(m[2]))


def outgoing(s: Stream, fmt: Format, wi: Vector, wm: Vector, variant: str) -> Vector:
    """The second direction."""
    match variant:
        case "mirror":
            return combination(2 * dot(wi, wm), wm, -ONE, wi)
        case "same":
            return wi
        case "opposite":
            return unit(*combination(-ONE, wi, s.scale(fmpq(1, 2**14), fmpq(1, 2**6)), hemisphere(s)))
    return direction(s, fmt, variant)


CORNERS = {
    "zero turn": {0: ZERO},
    "zero reach": {1: ZERO},
    "zero": {0: ZERO, 1: ZERO, 2: ZERO},
    "quarter": {0: fmpq(1, 4)},
    "half": {0: fmpq(1, 2), 1: fmpq(1, 2)},
}


def numbers(s: Stream, fmt: Format, variant: str) -> tuple[fmpq, ...]:
    """Eight uniform numbers on the dtype's own grid in [0, 1); a variant puts some of the first three into a corner."""
    step = fmpq(1, 1 << fmt.precision)
    u = {i: s.below(1 << fmt.precision) * step for i in range(8)}
    corners = CORNERS | {
        "last turn": {0: 1 - step},
        "last reach": {1: 1 - step},
        "last": {0: 1 - step, 1: 1 - step, 2: 1 - step},
        "tiny reach": {1: step / 2 ** (s.below(6))},
    }
    return tuple((u | corners.get(variant, {})).values())


def index(s: Stream, variant: str) -> fmpq:
    """An index of refraction, or the ratio of two."""
    match variant:
        case "one":
            return ONE
        case "near one":
            return 1 + s.sign() * s.scale(fmpq(1, 2**12), fmpq(1, 2**7))
        case "dense":
            return s.uniform(fmpq(6, 5), fmpq(5, 2))
    return s.scale(fmpq(1, 2), 3)


def cosine(s: Stream, eta: fmpq, variant: str) -> fmpq:
    """A cosine of incidence; `critical` is just beside total reflection at `eta`."""
    match variant:
        case "zero":
            return ZERO
        case "one":
            return ONE
        case "grazing":
            return s.scale(fmpq(1, 2**14), fmpq(1, 2**5))
        case "negative":
            return -s.uniform(0, 1)
        case "critical" if eta > 1:
            return root(1 - 1 / (eta * eta)) * (1 + s.sign() * s.scale(fmpq(1, 2**13), fmpq(1, 2**8)))
        case "total" if eta > 1:
            return root(1 - 1 / (eta * eta)) * s.uniform(0, 1)
    return s.uniform(0, 1)


def part(s: Stream, variant: str) -> fmpq:
    """A share in [0, 1], such as a masking term or a reflectance."""
    return {"zero": ZERO, "one": ONE}.get(variant, s.uniform(0, 1))


class Draw:
    """The quantities that a function may ask for, all of one surface; each is drawn when it is first asked for.

    Each has a stream of its own, so that none depends on which others were drawn.
    """

    def __init__(self, label: tuple[object, ...], fmt: Format, theme: Mapping[str, str]) -> None:
        self._label, self._fmt, self._theme = label, fmt, theme

    def _stream(self, quantity: str) -> Stream:
        return Stream(*self._label, quantity)

    def _variant(self, quantity: str) -> str:
        return self._theme.get(quantity, "plain")

    @cached_property
    def alpha(self) -> tuple[fmpq, fmpq]:
        return roughness(self._stream("alpha"), self._variant("alpha"))

    @cached_property
    def _canonical(self) -> Matrix:
        return canonical(self._stream("canonical"), self.alpha, self._variant("A"))

    @cached_property
    def A(self) -> Matrix:
        return general(self._stream("A"), self._canonical, self._variant("A"))

    @cached_property
    def wi(self) -> Vector:
        return direction(self._stream("wi"), self._fmt, self._variant("wi"))

    @cached_property
    def wm(self) -> Vector:
        return micronormal(self._stream("wm"), self._fmt, self._canonical, self.wi, self.eta, self._variant("wm"))

    @cached_property
    def wo(self) -> Vector:
        return outgoing(self._stream("wo"), self._fmt, self.wi, self.wm, self._variant("wo"))

    @cached_property
    def slope(self) -> tuple[fmpq, fmpq]:
        x, y, z = self.wm
        return (-x / z, -y / z) if z else (ZERO, ZERO)

    @cached_property
    def mean(self) -> tuple[fmpq, fmpq]:
        ex, ey, _ = self._canonical[2]
        return -ex, -ey

    @cached_property
    def scatter(self) -> tuple[tuple[fmpq, fmpq], tuple[fmpq, fmpq]]:
        (c00, c10, _), (_, c11, _), _ = self._canonical
        return (c00 * c00, c00 * c10), (c00 * c10, c10 * c10 + c11 * c11)

    @cached_property
    def angles(self) -> tuple[fmpq, ...]:
        s = self._stream("angles")
        return (ZERO,) * 3 if self._variant("angles") == "zero" else tuple(s.uniform(-3, 3) for _ in range(3))

    @cached_property
    def rows(self) -> tuple[tuple[fmpq, ...], ...]:
        u = numbers(self._stream("u"), self._fmt, self._variant("u"))
        return u[0:2], u[2:4], u[4:6], u[6:8]

    @cached_property
    def u(self) -> tuple[fmpq, ...]:
        return self.rows[0]

    @cached_property
    def u3(self) -> tuple[fmpq, ...]:
        return *self.rows[0], self.rows[1][0]

    @cached_property
    def eta(self) -> fmpq:
        return index(self._stream("eta"), self._variant("eta"))

    @cached_property
    def n_o(self) -> fmpq:
        return index(self._stream("n_o"), "plain")

    @cached_property
    def n_i(self) -> fmpq:
        return self.n_o * self.eta

    @cached_property
    def cos_i(self) -> fmpq:
        return cosine(self._stream("cos_i"), self.eta, self._variant("cos_i"))

    @cached_property
    def k(self) -> fmpq:
        return ZERO if self._variant("k") == "zero" else self._stream("k").scale(fmpq(1, 16), 8)

    @cached_property
    def gamma(self) -> fmpq:
        return fmpq(2) if self._variant("gamma") == "two" else 1 + self._stream("gamma").scale(fmpq(1, 4), 16)

    @cached_property
    def size(self) -> fmpq:
        return self._stream("size").scale(fmpq(1, 4), 4)

    @cached_property
    def D(self) -> fmpq:
        return self._stream("D").scale(fmpq(1, 2**8), 2**8)

    def __getattr__(self, quantity: str) -> fmpq:
        """The shares: masking terms and reflectances."""
        if quantity not in {"g1_i", "g1_o", "G2", "F", "f0"}:
            raise AttributeError(quantity)
        return part(self._stream(quantity), self._variant(quantity))
