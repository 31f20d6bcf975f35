"""Properties: the text form holds the same bits as the JSON; `scanf` reads it; answers are read up to the first bad line."""

import shutil
import subprocess

import pytest

from ggxref.golden import generate, text
from ggxref.golden.cases import leaves
from ggxref.golden.reading import read

ORDER = ("ndf.ggx,ellipsoid.sggx", "f64,f16", 24, 1)


@pytest.fixture(scope="module")
def directory(tmp_path_factory):
    base = tmp_path_factory.mktemp("text")
    generate.generate(generate.order(*ORDER), base / "json")
    generate.generate(generate.order(*ORDER, "text"), base / "text")
    return base


def test_one_file_a_dtype_with_the_same_words(directory):
    tests = list(read(directory / "json"))
    for function, fmt, group in text.groups(tests):
        lines = (directory / "text" / f"{function.id}.{fmt.name}.txt").read_text().splitlines()
        valid = [t for t in group if not t.outcomes]
        name, id, dtype, count, inputs, outputs = lines[0].split()[:6]
        assert (name, id, dtype, int(count)) == ("ggxref-text-1", function.id, fmt.name, len(valid))
        assert len(lines) == 1 + len(valid)
        for line, t in zip(lines[1:], valid, strict=True):
            assert t.result
            bits = [*leaves(t.inputs), *leaves(t.result.expected)]
            assert [int(w, 16) for w in line.split()] == [t.id, *bits, t.result.ulp]
            assert len(bits) == int(inputs) + int(outputs)


# Reads a file with scanf alone; prints the number of tests and the sum of all words modulo 2^32.
SCANF = r"""
#include <stdio.h>
int main(void) {
    char function[64], dtype[8], argument[32];
    unsigned count, in, out, id, ulp, seen = 0, total = 0;
    unsigned long long word, sum = 0;
    while (scanf("ggxref-text-1 %63s %7s %u %u %u", function, dtype, &count, &in, &out) == 5) {
        for (unsigned words = 0; words < in;) {
            unsigned size;
            if (scanf(" %31[^:]:%u", argument, &size) != 2) return 1;
            words += size;
        }
        for (unsigned i = 0; i < count; i++) {
            if (scanf("%x", &id) != 1) return 2;
            for (unsigned j = 0; j < in + out; j++) {
                if (scanf("%llx", &word) != 1) return 3;
                sum += word;
            }
            if (scanf("%x ", &ulp) != 1) return 4;
            seen++;
        }
        total += count;
    }
    printf("%u %u %llu\n", seen, total, sum & 0xffffffffu);
    return 0;
}
"""


@pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler")
def test_scanf_reads_it(directory, tmp_path):
    (tmp_path / "read.c").write_text(SCANF)
    subprocess.run(["cc", "-o", tmp_path / "read", tmp_path / "read.c"], check=True)
    data = b"".join(path.read_bytes() for path in sorted((directory / "text").glob("*.txt")))
    tests = [t for t in read(directory / "json") if t.result and not t.outcomes]
    total = sum(bits for t in tests if t.result for bits in [*leaves(t.inputs), *leaves(t.result.expected)])
    out = subprocess.run([tmp_path / "read"], input=data, capture_output=True, check=True).stdout
    assert out.decode().split() == [str(len(tests)), str(len(tests)), str(total % 2**32)]


@pytest.mark.parametrize(
    ("lines", "message"),
    {
        "no header": (["1 3c00"], "line 1: wanted '<function> <dtype>', got '1 3c00'"),
        "unknown id": (["ndf.ggx f16", "fff 3c00"], "line 2: no test 'fff' in ndf.ggx f16"),
        "a word too many": (["ndf.ggx f16", "1 3c00 3c00"], "line 2: wanted 1 hex words of 4 digits"),
        "too wide": (["ndf.ggx f16", "1 0003c00"], "line 2: wanted 1 hex words of 4 digits"),
        "a decimal": (["ndf.ggx f16", "1 1.0"], "line 2: wanted 1 hex words of 4 digits, got '1.0'"),
        "binary": (["\x00\x01\x02"], "line 1: wanted '<function> <dtype>'"),
    }.values(),
)
def test_garbage_is_named_with_its_line(directory, lines, message):
    found, garbage = text.answers(lines, list(read(directory / "json")))
    assert message in garbage
    assert not found


def test_answers_before_the_garbage_count_and_a_refusal_is_one(directory):
    lines = ["ndf.ggx f16", "1 3C00", "", "2 -", "what?", "3 0000"]
    found, garbage = text.answers(lines, list(read(directory / "json")))
    assert found[("ndf.ggx", "f16", 1)] == 0x3C00
    assert isinstance(found[("ndf.ggx", "f16", 2)], text.Failure)
    assert garbage.startswith("line 5")
    assert len(found) == 2
