"""The README's example prints what the README says that it prints."""

import contextlib
import io
import re
from pathlib import Path

import numpy as np

README = (Path(__file__).parents[1] / "README.md").read_text()


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", README, re.S)


def test_example_prints_its_numbers():
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(blocks("python")[0], {})
    number = r"-?\d+\.?\d*(?:e[-+]?\d+)?"
    expected = blocks("text")[0]
    assert re.sub(number, "#", " ".join(printed.getvalue().split())) == re.sub(number, "#", " ".join(expected.split()))
    # float32 sums over 10⁶ normals may differ in their last digits from one processor to the next.
    numbers = [np.array(re.findall(number, text), float) for text in (printed.getvalue(), expected)]
    np.testing.assert_allclose(*numbers, rtol=1e-4, atol=1e-6)
