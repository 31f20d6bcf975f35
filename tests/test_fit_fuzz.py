"""A slice of experiments/fit_fuzz.py: on any bytes a reader gives a measurement or one line that says what is wrong."""

import random
import tracemalloc

import fit_fuzz
import pytest

CASES = 1500


@pytest.mark.parametrize("seed", [1, 2])
def test_any_bytes(tmp_path, seed):
    source, seeds = random.Random(seed), fit_fuzz.seeds()
    outcomes = [fit_fuzz.outcome(fit_fuzz.mutated(source, seeds), tmp_path / "case") for _ in range(CASES)]
    # Both must occur often, or the cases are all noise or all whole.
    assert outcomes.count("read") > 50 and outcomes.count("refused") > 500


def test_memory_stays_of_the_files_size(tmp_path):
    source, seeds = random.Random(3), fit_fuzz.seeds()
    cases = [fit_fuzz.mutated(source, seeds) for _ in range(200)]
    tracemalloc.start()
    for content in cases:
        fit_fuzz.outcome(content, tmp_path / "case")
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # The largest seed has 4 kB; the headers' claims go up to 2**64.
    assert most < 2**24


def test_a_broken_reader_would_show(tmp_path, monkeypatch):
    monkeypatch.setattr("ggxref.fit.readers.hashlib.sha256", lambda _: 1 / 0)
    source, seeds = random.Random(4), fit_fuzz.seeds()
    with pytest.raises(ZeroDivisionError):
        for _ in range(20):
            fit_fuzz.outcome(fit_fuzz.mutated(source, seeds), tmp_path / "case")
