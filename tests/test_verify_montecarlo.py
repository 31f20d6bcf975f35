"""Streamed means: right, independent of how the blocks are shared out, exact in their sums; two processes give one's bits."""

import json
import os
import socket
import subprocess
import sys
from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.stats

from ggxref.errors import InputError
from ggxref.verify import distributed, montecarlo
from ggxref.verify.streamed import over_normals

SKEWED = np.array([[0.5, 0.1, 0.3], [-0.2, 0.8, 0.1], [0.1, -0.3, 1.4]])


def square(u):
    return u[0] ** 2


def test_mean_lies_within_its_error():
    got = montecarlo.mean(square, 1 << 18, name="square", about=0.3)
    assert got.count == 1 << 18
    assert got.error == pytest.approx(np.sqrt(4 / 45 / got.count), rel=0.01)
    assert abs(got.mean - 1 / 3) < 4 * got.error


def test_pivot_and_sharing_of_blocks_do_not_matter(monkeypatch):
    """`about` moves the sums, not the mean; the size of a batch, as the number of devices, only who computes a block."""
    first = montecarlo.mean(square, 40 * montecarlo.BLOCK, name="square", about=0.25)
    # A deviation is rounded to float32, as the sample was before it.
    assert montecarlo.mean(square, 40 * montecarlo.BLOCK, name="square").mean == pytest.approx(first.mean, rel=2**-24)
    monkeypatch.setattr(montecarlo, "BATCH", 7)
    assert montecarlo.mean(square, 40 * montecarlo.BLOCK, name="square", about=0.25) == first


def test_lattice_is_closer_than_random_numbers():
    random, lattice = (
        abs(montecarlo.mean(square, 1 << 20, name="a", points=points).mean - 1 / 3) for points in ("random", "lattice")
    )
    assert lattice < 1e-5 < random


def test_octahedron_covers_every_direction_once():
    """∫ dm = 4π, whatever matrix carries the directions; and ∫ z⁺ dm = π."""
    whole = montecarlo.mean(over_normals(lambda m: 0 * m[0] + 1.0, SKEWED), 1 << 20, name="sphere", points="lattice")
    upper = montecarlo.mean(over_normals(lambda m: (m[2] > 0) * m[2], SKEWED), 1 << 20, name="sphere", points="lattice")
    assert whole.mean == pytest.approx(4 * np.pi, rel=1e-4)
    assert upper.mean == pytest.approx(np.pi, rel=1e-4)


def test_sums_are_exact():
    """Terms that cancel leave what floating-point addition loses."""
    rows = [np.array([1e16, 1.0]), np.array([1.0, 1e-17]), np.array([-1e16, -1.0])]
    assert montecarlo._shared(iter(rows)) == (Fraction(1), Fraction(1e-17))
    assert sum(map(Fraction, montecarlo._split(Fraction(1e16) + Fraction(1e-17)))) == Fraction(1e16) + Fraction(1e-17)


@pytest.mark.parametrize("where", ["host", "host:1,2", "host:port,2,0", "host:9000,2,2", "host:70000,2,0", ":9000,2,0"])
def test_bad_address_says_what_it_is(where):
    with pytest.raises(InputError, match=r"--distributed: .*(HOST:PORT|PORT is)"):
        distributed.join(where)


COMMAND = ["-c", "from ggxref.cli import main; main()", "verify", "--thorough", "--samples", "4096"]
SELECTION = ["--paper", "heitz2014", "--equation", "1"]


@pytest.mark.slow
def test_two_processes_find_what_one_finds(tmp_path):
    """Ordinary checks are shared out, the streamed one's blocks too; at these few samples its control may pass."""

    def started(name, *more):
        command = [sys.executable, *COMMAND, *SELECTION, "--json", str(tmp_path / name), *more]
        return subprocess.Popen(command, env={**os.environ, "JAX_PLATFORMS": "cpu"}, stdout=subprocess.PIPE, text=True)

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    pair = [started(f"{rank}.json", "--distributed", f"{address},2,{rank}") for rank in (0, 1)]
    alone = started("alone.json")
    outputs = [process.communicate(timeout=400)[0] for process in [*pair, alone]]
    assert "5 checks:" in outputs[0] and "checks:" not in outputs[1]
    assert not (tmp_path / "1.json").exists()
    two, one = (json.loads((tmp_path / name).read_text())["checks"] for name in ("0.json", "alone.json"))
    for record in [*two, *one]:
        del record["seconds"]
    assert two == one and len(one) == 5


def test_random_numbers_are_splitmix64():
    """The first outputs of seed 0 that the generator's authors publish, and numbers in [0, 1) without a pattern."""
    with jax.enable_x64(True):
        u = np.asarray(montecarlo._random(np.uint32(0), jnp.uint32(0), 2))
    published = [0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F]
    # The published sequence starts one step on.
    expected = [[(z >> 40) * 2.0**-24 for z in published], [(z & 0xFFFFFF) * 2.0**-24 for z in published]]
    assert u[:, 1:4].tolist() == expected
    assert u.min() >= 0 and u.max() < 1
    assert scipy.stats.kstest(u.ravel(), "uniform").pvalue > 1e-6
    assert abs(np.corrcoef(u)[0, 1]) < 5 / montecarlo.BLOCK**0.5  # 5 standard deviations
