"""Are wrong formulas rejected, and named? Each mutant's own answers, graded over shipped float32 vectors.

    python experiments/grade_mutants.py

For each mutant the first function that it gets wrong. Prints what was diagnosed otherwise; exit code 1 if a mutant passes
or fewer than nine of ten are named.
"""

import sys

from ggxref.golden import grade, text
from ggxref.golden.diagnose import prediction
from ggxref.golden.mistakes import MUTANTS
from ggxref.golden.mutants import Mutant
from ggxref.golden.reading import SHIPPED, Test, read

Group = list[Test]


def graded(mutant: Mutant, group: Group) -> grade.Grade:
    """The mutant's answers; the right one where it has none."""
    answers: text.Answers = {}
    for t in group:
        predicted = prediction(mutant, t)
        right = t.result.expected if t.result else None
        answers[t.function.id, t.fmt.name, t.id] = right if predicted is None else predicted
    return grade.collect(group, answers, strict=False)


def first_failure(mutant: Mutant, groups: list[Group]) -> grade.Grade | None:
    for group in groups:
        if any(prediction(mutant, t) is not None for t in (group[0], group[-1])):
            result = graded(mutant, group)
            if not result.passed:
                return result
    return None


def main() -> None:
    tests = (t for t in read(SHIPPED) if t.fmt.name == "f32" and not t.outcomes and not t.function.derivative)
    groups = [group for _, _, group in text.groups(tests)]
    rejected = named = 0
    for mutant in MUTANTS:
        result = first_failure(mutant, groups)
        names = [d.mutant.name for d in result.diagnoses] if result else []
        rejected += result is not None
        named += names == [mutant.name]
        if names != [mutant.name]:
            print(f"{mutant.name}: {'passes everywhere' if result is None else f'named {names}'}")
    print(f"{len(MUTANTS)} mutants, {rejected} rejected, {named} named")
    sys.exit(rejected < len(MUTANTS) or named < 0.9 * len(MUTANTS))


if __name__ == "__main__":
    main()
