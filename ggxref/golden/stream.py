"""Random numbers that are the same on every machine and in every version: SHA-256 of a label and a counter."""

import hashlib
import math

from flint import fmpq

from ggxref.golden.linear import Vector


class Stream:
    """An endless sequence of random bits named by its label; streams of different labels are independent."""

    def __init__(self, *label: object) -> None:
        self._key = "/".join(map(str, label)).encode()
        self._count = 0

    def bits(self, n: int) -> int:
        """The next integer in [0, 2^n), n <= 256."""
        block = hashlib.sha256(self._key + self._count.to_bytes(8, "big")).digest()
        self._count += 1
        return int.from_bytes(block, "big") >> (256 - n)

    def below(self, n: int) -> int:
        """An integer in [0, n); its bias is below 2^-190 for n < 2^60."""
        return self.bits(256) * n >> 256

    def uniform(self, low: fmpq | int = 0, high: fmpq | int = 1) -> fmpq:
        """A multiple of 2^-64 of the interval [low, high)."""
        low, high = fmpq(low), fmpq(high)
        return low + (high - low) * fmpq(self.bits(64), 1 << 64)

    def scale(self, low: fmpq | int, high: fmpq | int) -> fmpq:
        """Between `low` and `high`, as much of it in each octave: 2^k (1 + f), k and f uniform."""
        low, high = fmpq(low), fmpq(high)
        octaves = math.ceil(high / low).bit_length()
        while True:
            x = low * 2 ** self.below(octaves) * self.uniform(1, 2)
            if x < high:
                return x

    def sign(self) -> int:
        return 1 - 2 * self.bits(1)

    def circle(self) -> tuple[fmpq, fmpq]:
        """A rational point on the unit circle, in every octant alike: from the tangent of half the angle."""
        t = self.uniform(-1, 1) * fmpq(27, 64)  # half of at least an eighth of a turn: tan(pi/8) < 27/64
        c, s = (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)
        return ((c, s), (-s, c), (-c, -s), (s, -c))[self.bits(2)]


def root(x: fmpq) -> fmpq:
    """Square root of a positive fraction to 128 bits or more, by integers alone."""
    shift = 256 + 2 * max(x.denominator.bit_length() - x.numerator.bit_length(), 0)
    return fmpq(math.isqrt((x.numerator << shift) // x.denominator), 1 << (shift // 2))


def unit(x: fmpq, y: fmpq, z: fmpq) -> Vector:
    """The vector divided by its length (to 128 bits)."""
    length = root(x * x + y * y + z * z)
    return x / length, y / length, z / length


def hemisphere(stream: Stream) -> Vector:
    """A rational unit vector with z > 0, uniform to within a factor of 4 / pi: the corners of a square are rejected."""
    while True:
        p, q = stream.uniform(-1, 1), stream.uniform(-1, 1)
        square = p * p + q * q
        if square < 1:  # the stereographic image of the upper half
            return 2 * p / (1 + square), 2 * q / (1 + square), (1 - square) / (1 + square)
