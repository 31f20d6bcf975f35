"""Bytes near those of real measurements, to try the readers on."""

import random
import struct
from pathlib import Path

import fit_data
import numpy as np

from ggxref.errors import InputError
from ggxref.fit.readers import parse

WORDS = [
    b"nan",
    b"inf",
    b"-1",
    b"1e308",
    b"1e-320",
    b"999999999999",
    b"0",
    b"\0",
    b"\n",
    b",",
    b" ",
    b"=",
    b"#",
    b"VARS ",
    b"h=9 w=9",
]
NUMBERS = [0, 1, 2, 127, 255, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**53, 2**63, 2**64 - 1]


def seeds() -> list[bytes]:
    """One small whole file of each format, and some that are cut."""
    surface = fit_data.rough_surface(5)
    degrees = fit_data.plane_angles((30.0,))[::20]
    table = fit_data.table(degrees, np.linspace(0.1, 1, len(degrees))).encode()
    fields = fit_data.rgl_fields(theta_i=(0.0, 30.0), grid=3) | {
        "vndf": np.ones((1, 2, 4, 4), "f4"), "ndf": np.ones((2, 4), "f4"), "sigma": np.ones((2, 4), "f4")}  # fmt: skip
    astm = b"VERSION 1\nVARS theta_i,phi_i,theta_s,phi_s,nir\n" + b"0.5,3.1,0.2,0.0,0.1\n" * 9
    whole = [table, astm, fit_data.x3p(surface), fit_data.matrix(surface).encode(), fit_data.npy(surface),
             fit_data.tensor_file(fields), fit_data.merl((0.1, 0.2, 0.3), (3, 2, 4))]  # fmt: skip
    return [*whole, *(content[: len(content) // 2] for content in whole), b""]


def mutated(source: random.Random, seeds: list[bytes]) -> bytes:
    content = bytearray(source.choice(seeds))
    for _ in range(source.choice((0, 1, 1, 2, 4, 16))):
        at = source.randrange(len(content) + 1)
        match source.randrange(6):
            case 0:
                content[at : at + 1] = bytes([source.randrange(256)])
            case 1:
                del content[at : at + source.choice((1, 2, 8, 64))]
            case 2:
                content[at:at] = source.choice(WORDS)
            case 3:
                number = struct.pack("<Q", source.choice(NUMBERS))[: source.choice((1, 2, 4, 8))]
                content[at : at + len(number)] = number
            case 4:
                other = source.choice(seeds)
                content[at:] = other[source.randrange(len(other) + 1) :]
            case 5:
                content[at : at + 8] = struct.pack(
                    "<d", source.choice((float("nan"), float("inf"), -1.0, 1e308, 5e-324))
                )
    return bytes(content)


def outcome(content: bytes, path: Path) -> str:
    """ "read" or "refused"; anything else that the readers do comes through."""
    pixel = (1e-6, 1e-6)
    try:
        found = parse(content, str(path), pixel)
    except InputError as error:
        assert "\n" not in str(error) and len(str(error)) < 2000, str(error)
        return "refused"
    values = found.values if hasattr(found, "values") else found.heights
    assert values.size <= max(len(content), 1)
    return "read"
