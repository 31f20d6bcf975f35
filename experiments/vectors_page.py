"""What does each flag of the shipped vectors catch? Writes the table of docs/vectors.md between its two marks.

    python experiments/vectors_page.py docs/vectors.md

For each flag: how many tests have it, and the wrong formula that is most its own: of the mutants that a test with this
flag kills, the one with the largest share of its kills there. The example is one such test.
"""

import sys
from collections import Counter, defaultdict
from pathlib import Path

from part import write_part

from ggxref.golden import flags, invalid, text
from ggxref.golden.diagnose import prediction
from ggxref.golden.mistakes import MUTANTS
from ggxref.golden.mutants import Mutant
from ggxref.golden.reading import SHIPPED, Test, read
from ggxref.golden.verdict import judge


def kills(tests: list[Test]) -> dict[str, list[Test]]:
    """The tests that each mutant fails."""
    killed: dict[str, list[Test]] = defaultdict(list)
    for _, _, group in text.groups(tests):
        for mutant in MUTANTS:
            if applies(mutant, group):
                killed[mutant.name] += [t for t in group if fails(mutant, t)]
    return killed


def applies(mutant: Mutant, group: list[Test]) -> bool:
    return any(prediction(mutant, t) is not None for t in group[:3])


def fails(mutant: Mutant, test: Test) -> bool:
    predicted = prediction(mutant, test)
    return predicted is not None and not judge(test, predicted).passed


def most_own(flag: str, killed: dict[str, list[Test]]) -> tuple[str, Test] | None:
    def share(name: str) -> float:
        return sum(flag in t.flags for t in killed[name]) / len(killed[name])

    names = [m.name for m in MUTANTS if any(flag in t.flags for t in killed[m.name])]
    if not names:
        return None
    name = max(names, key=share)
    return name, next(t for t in killed[name] if flag in t.flags)


def row(flag: str, sentence: str, count: int, found: tuple[str, Test] | None) -> str:
    name, test = found or ("any number for a NaN", None)
    sentence = sentence.replace("|", r"\|")
    example = f"{test.function.id} {test.fmt.name} {test.id}" if test else ""
    return f"| {flag} | {sentence} | {count} | {name} | {example} |"


def main() -> None:
    page = Path(sys.argv[1])
    everything = list(read(SHIPPED))
    counts = Counter(flag for t in everything for flag in t.flags)
    plain = [t for t in everything if not t.function.derivative]
    killed = kills([t for t in plain if t.fmt.name == "f32"])
    # What no f32 test has.
    rare = {"F16Overflow", "IntermediateOverflow"}
    half = kills([t for t in plain if t.fmt.name == "f16" and rare & set(t.flags)])
    rows = [
        row(flag, sentence, counts[flag], most_own(flag, killed) or most_own(flag, half))
        for flag, sentence in (flags.SENTENCES | invalid.SENTENCES).items()
    ]
    table = "\n".join(
        ["| flag | what it catches | tests | kills, among others | in test |", "|---|---|--:|---|---|", *rows, ""]
    )
    write_part(page, "flags: experiments/vectors_page.py", table)


if __name__ == "__main__":
    main()
