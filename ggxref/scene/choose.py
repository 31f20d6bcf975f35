"""The cheapest models with which a scene's picture stays within a tolerance of the richest ones'.

Pruned, not exhaustive: one picture for each option of each axis, in which every material that has the option takes it: a
material's own pixels tell its own deviation. The options within the tolerance that are no dearer than the richest are
taken together and measured as one; what is too much is taken back, the largest first. Samplers do not move the
expectation of a picture, and are chosen by cost alone.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ggxref.errors import InputError
from ggxref.scene import build, materials
from ggxref.scene.build import Choice
from ggxref.scene.compare import Batches, Deviation
from ggxref.scene.materials import BOUNDED
from ggxref.scene.read import Material, Scene
from ggxref.scene.search import AXES, TRIAL, Choices, Search

DEARER = 1.1
"""Times the richest's cost: what an option may seem to cost and still be taken, as two timings of one program differ."""
TURNS_OF_ALL = 15
"""Times that whole pictures, of `TRIAL` samples a batch, are rendered in turn: the middle ratio of their costs counts."""
OF_MEDIAN = math.sqrt(math.pi / 2)
"""Standard error of a normal sample's median, in that of its mean."""


@dataclass(frozen=True)
class Step:
    """A material's deviation with one option in place of its richest. `ns`: of a bounce's formulas."""

    material: str
    axis: str
    option: str
    deviation: Deviation
    ns: float


@dataclass(frozen=True)
class Sampler:
    """`ns`: of a bounce's formulas; `noise`: variance of a sample in the material's pixels over the cap's."""

    material: str
    sampler: str
    ns: float
    noise: float

    @property
    def effort(self) -> float:
        """Time that a given error takes, up to a factor that the scene sets."""
        return self.ns * self.noise


@dataclass(frozen=True)
class Result:
    """`deviations`: of the chosen picture from the richest, per material; `costs`: nanoseconds of a bounce's formulas with
    the richest, per material.

    `faster`: the richest's time for a whole picture over the chosen's, at equal noise, at least 1; `faster_error`: its
    standard error.
    """

    scene: Scene
    tolerance: float
    richest: Choices
    chosen: Choices
    steps: tuple[Step, ...]
    samplers: tuple[Sampler, ...]
    costs: dict[str, float]
    deviations: dict[str, Deviation]
    pictures: dict[str, Batches]
    faster: float
    faster_error: float


def with_option(material: Material, choice: Choice, axis: str, option: str) -> Choice:
    """The choice with one axis changed, and a sampler that can draw what it then has."""
    choice = replace(choice, **{axis: option})
    if axis == "model" and material.ndf == "ggx":
        choice = replace(choice, sampler="ellipsoid_cap" if option == "ellipsoid" else "spherical_cap")
    return choice


def stages(scene: Scene) -> int:
    """How often `choose` says what it does, at most but for what it takes back."""
    search = Search(scene, 0.0, lambda text: None)
    options = {(axis, each) for material in scene.materials for axis in AXES for each in search.options(material, axis)}
    return 3 + len(options) + sum(material.surface != "diffuse" for material in scene.materials)


def choose(scene: Scene, tolerance: float, say: Callable[[str], None] = lambda text: None) -> Result:
    """Search; `say` is told what is done next."""
    if not (np.isfinite(tolerance) and tolerance >= 0):
        raise InputError(f"--tolerance = {tolerance:g}; need 0 or a positive number, the deviation over mean radiance")
    search = Search(scene, tolerance, say)
    visible = [name for name in search.named if name in search.regions]
    if not visible:
        raise InputError(f"{scene.path}: view sees none of the shapes; there is nothing to choose for")
    say("the richest")
    if not search.bright:
        raise InputError(f"{scene.path}: no light reaches the view; there is no picture to keep")
    costs = {name: search.cost(name, search.richest[name]) for name in visible}
    steps = _steps(search)
    chosen, deviations = _together(search, _affordable(search, steps), steps)
    samplers = _samplers(search, chosen)
    candidates = [search.richest]
    for each in (chosen, _cheapest_samplers(search, chosen, samplers)):
        candidates += [each] if each not in candidates else []
    best, pictures, faster, error = _fastest(search, candidates)
    if best == search.richest:
        deviations = {name: Deviation(0.0, 0.0) for name in search.regions}
    found = search.scene, tolerance, search.richest, best, steps, samplers, costs, deviations, pictures
    return Result(*found, faster, error)


def _steps(search: Search) -> tuple[Step, ...]:
    steps = []
    for axis, every in AXES.items():
        for option in every:
            having = [name for name, each in search.named.items() if option in search.options(each, axis)]
            if not having:
                continue
            search.say(f"{axis}: {option}")
            choices = dict(search.richest)
            for name in having:
                choices[name] = with_option(search.named[name], choices[name], axis, option)
            found = search.measure(choices)
            steps += [
                Step(name, axis, option, found[name], search.cost(name, choices[name]))
                for name in having
                if name in found
            ]
    return tuple(steps)


def _takes(search: Search, step: Step) -> bool:
    cheap = step.ns <= DEARER * search.cost(step.material, search.richest[step.material])
    return cheap and search.within(step.deviation)


def _affordable(search: Search, steps: tuple[Step, ...]) -> dict[str, Choice]:
    """Per material and axis the plainest option that alone is within the tolerance, and no dearer."""
    choices = dict(search.richest)
    for axis in AXES:
        for step in reversed(steps):  # the plainest is taken last
            if step.axis == axis and _takes(search, step):
                material = search.named[step.material]
                choices[step.material] = with_option(material, choices[step.material], axis, step.option)
    return choices


def _together(
    search: Search, choices: dict[str, Choice], steps: tuple[Step, ...]
) -> tuple[dict[str, Choice], dict[str, Deviation]]:
    """Measure them as one picture; take back, one at a time, the largest step of a material that is too far off."""
    while True:
        search.say("all that are within, together")
        if choices == search.richest:
            return choices, {name: Deviation(0.0, 0.0) for name in search.regions}
        found = search.measure(choices)
        failing = [name for name, each in found.items() if not search.within(each)]
        if not failing:
            return choices, found
        taken = [step for step in steps if getattr(choices[step.material], step.axis) == step.option]
        # A material that has no step of its own to take back is off because of its neighbours.
        own = [step for step in taken if step.material in failing] or taken
        worst = max(own, key=lambda step: step.deviation.most)
        material, axis = search.named[worst.material], worst.axis
        every = AXES[axis]
        richer = every[every.index(worst.option) + 1]
        choices[worst.material] = with_option(material, choices[worst.material], axis, richer)


def _samplers(search: Search, chosen: dict[str, Choice]) -> tuple[Sampler, ...]:
    """Exact samplers of one density share its variance; the others' is measured, if a sample of theirs is cheaper."""
    found: list[Sampler] = []
    base: Batches | None = None
    pictures: dict[str, Batches] = {}
    for name, choice in chosen.items():
        material = search.named[name]
        if material.surface == "diffuse" or name not in search.regions:
            continue
        search.say(f"samplers of {name}")
        for sampler in materials.samplers(build.kind_of(material, choice)):
            if sampler == "v_cavity":
                continue  # the visible normals of another microsurface
            ns, noise = search.cost(name, replace(choice, sampler=sampler)), 1.0
            other_density = sampler in BOUNDED or sampler == "normals"
            if sampler == "normals" and DEARER * ns >= search.cost(name, choice):
                continue  # its variance is larger
            if other_density:
                base = base or search.whole(chosen, search.samples)
                pictures[sampler] = pictures.get(sampler) or search.whole(
                    _all_with(search, chosen, sampler), search.samples
                )
                region = search.regions[name]
                noise = float(pictures[sampler].variance[region].mean() / base.variance[region].mean())
            found.append(Sampler(name, sampler, ns, noise))
    return tuple(found)


def _all_with(search: Search, chosen: dict[str, Choice], sampler: str) -> dict[str, Choice]:
    return {
        name: replace(choice, sampler=sampler)
        if sampler in materials.samplers(build.kind_of(search.named[name], choice))
        else choice
        for name, choice in chosen.items()
    }


def _cheapest_samplers(search: Search, chosen: dict[str, Choice], samplers: tuple[Sampler, ...]) -> dict[str, Choice]:
    """Materials of one kind share a sampler, by their pixels' effort: a second sampler would be a second branch for all."""
    best = dict(chosen)
    sampled = {each.material: {other.sampler: other.effort for other in samplers if other.material == each.material}
               for each in samplers}  # fmt: skip
    family = {name: build.formless(build.kind_of(search.named[name], chosen[name])) for name in sampled}
    for name in sampled:
        alike = [other for other in sampled if family[other] == family[name]]
        shared = [each for each in sampled[name] if all(each in sampled[other] for other in alike)]
        effort = {each: sum(sampled[other][each] * search.regions[other].sum() for other in alike) for each in shared}
        best[name] = replace(chosen[name], sampler=min(effort, key=effort.__getitem__))
    return best


def _fastest(
    search: Search, candidates: list[dict[str, Choice]]
) -> tuple[dict[str, Choice], dict[str, Batches], float, float]:
    """Of whole pictures, the first of them the richest, the one with the least time at equal noise; both; how much faster
    it is, and the standard error of that.

    Formulas timed by themselves say what to try. They cannot decide: the compiler mixes them with what is around them.
    """
    search.say("the richest and the chosen, timed in turns")
    pictures = [search.whole(each, search.samples) for each in candidates]
    noise = np.array([picture.variance.mean() for picture in pictures])
    ns = np.empty((TURNS_OF_ALL, len(candidates)))
    for turn in range(TURNS_OF_ALL):
        for k in range(len(candidates))[:: 1 if turn % 2 else -1]:
            ns[turn, k] = search.whole(candidates[k], TRIAL, seed=turn).ns_per_sample
    ratios = ns[:, :1] / ns * (noise[0] / noise)
    faster = np.median(ratios, axis=0)
    best = int(faster.argmax())
    error = OF_MEDIAN * ratios[:, best].std(ddof=1) / math.sqrt(TURNS_OF_ALL)
    # The whole pictures' own times are of one turn each.
    timed = [replace(pictures[k], ns_per_sample=float(np.median(ns[:, k]))) for k in (0, best)]
    return candidates[best], dict(zip(("richest", "chosen"), timed, strict=True)), float(faster[best]), float(error)
