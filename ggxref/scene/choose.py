"""The cheapest models with which a scene's picture stays within a tolerance of the richest ones'.

Pruned, not exhaustive: if the plainest of everything is within, no more is asked. Else one picture for each option of each
axis, in which every material that has the option takes it: a material's own pixels tell its own deviation. The options
within the tolerance are then taken together and measured as one; what is too much is taken back, the largest first.
Samplers do not move the expectation of a picture, and are chosen by cost alone.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ggxref.errors import InputError
from ggxref.scene import build, compare, materials, render
from ggxref.scene.build import Choice
from ggxref.scene.compare import Batches, Deviation
from ggxref.scene.materials import BOUNDED, FRESNELS, G2S
from ggxref.scene.read import Material, Scene

AXES = {"model": build.MODELS, "g2": G2S[:2], "fresnel": FRESNELS}
"""Options of each axis, plainest first. V-cavities are another microsurface, not a plainer one."""
COUNT = 8
"""Batches: enough for an error of the error of 27 %."""
MORE = 4
"""Once, that many times the samples where an answer is within its error of the tolerance."""

Choices = Mapping[str, Choice]


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


@dataclass(frozen=True)
class Result:
    """`deviations`: of the chosen picture from the richest, per material; `faster`: at equal noise, whole pictures."""

    scene: Scene
    tolerance: float
    richest: Choices
    chosen: Choices
    steps: tuple[Step, ...]
    samplers: tuple[Sampler, ...]
    deviations: dict[str, Deviation]
    pictures: dict[str, Batches]
    faster: float


class _Search:
    """Pictures of one scene, each rendered once."""

    def __init__(self, scene: Scene, tolerance: float, say: Callable[[str], None]):
        self.scene, self.tolerance, self.say = scene, tolerance, say
        self.settings = render.Settings(scene.width, scene.height)
        self.named = {material.name: material for material in scene.materials}
        self.richest = {name: build.richest(material) for name, material in self.named.items()}
        self.regions = {name: region for name, region in build.seen(scene).items() if region.any()}
        self._references: dict[int, Batches] = {}
        self._costs: dict[materials.Kind, float] = {}

    def _batches(self, choices: Choices, samples: int, *, by_row: bool) -> Batches:
        kinds, world = build.world(self.scene, choices, by_row=by_row)
        return compare.batches(kinds, world, self.settings, count=COUNT, samples=samples, seed=0)

    def _reference(self, samples: int) -> Batches:
        if samples not in self._references:
            self._references[samples] = self._batches(self.richest, samples, by_row=True)
        return self._references[samples]

    def measure(self, choices: Choices) -> dict[str, Deviation]:
        """From the richest, per material; with more samples where the first leave it open."""
        found: dict[str, Deviation] = {}
        few = max(self.scene.samples // COUNT, 2)
        for samples in (few, MORE * few):
            picture = self._batches(choices, samples, by_row=True)
            found = compare.deviations(picture, self._reference(samples), self.regions)
            if not any(each.least < self.tolerance <= each.most for each in found.values()):
                break
        return found

    def within(self, deviation: Deviation) -> bool:
        """Strictly: within 0 is nothing, so tolerance 0 keeps the richest."""
        return deviation.most < self.tolerance

    def options(self, material: Material, axis: str) -> tuple[str, ...]:
        """What is plainer than the material's richest on an axis."""
        if material.surface == "diffuse" or (axis == "fresnel" and material.surface == "dielectric"):
            return ()
        every = AXES[axis]
        return every[: every.index(getattr(self.richest[material.name], axis))]

    def cost(self, name: str, choice: Choice) -> float:
        kind = build.kind_of(self.named[name], choice)
        if kind not in self._costs:
            kinds, world = build.world(replace_materials(self.scene, self.named[name]), {name: choice})
            self._costs[kind] = compare.shading_cost(kinds[0], world.rows[0])
        return self._costs[kind]

    def whole(self, choices: Choices) -> Batches:
        """With the formulas compiled for these choices alone: what they cost."""
        return self._batches(choices, max(self.scene.samples // COUNT, 2), by_row=False)


def replace_materials(scene: Scene, material: Material) -> Scene:
    """The scene with one material, and only the shapes that have it."""
    shapes = tuple(shape for shape in scene.shapes if shape["material"] == material.name)
    return replace(scene, materials=(material,), shapes=shapes)


def with_option(material: Material, choice: Choice, axis: str, option: str) -> Choice:
    """The choice with one axis changed, and a sampler that can draw what it then has."""
    choice = replace(choice, **{axis: option})
    if axis == "model" and material.ndf == "ggx":
        choice = replace(choice, sampler="ellipsoid_cap" if option == "ellipsoid" else "spherical_cap")
    return choice


def choose(scene: Scene, tolerance: float, say: Callable[[str], None] = lambda text: None) -> Result:
    """Search; `say` is told what is being done."""
    if not (np.isfinite(tolerance) and tolerance >= 0):
        raise InputError(f"--tolerance = {tolerance:g}; need 0 or a positive number, the deviation over mean radiance")
    search = _Search(scene, tolerance, say)
    visible = [name for name in search.named if name in search.regions]
    if not visible:
        raise InputError(f"{scene.path}: view sees none of the shapes; there is nothing to choose for")
    plainest = _plainest(search)
    say("the plainest of everything")
    deviations = search.measure(plainest)
    steps: tuple[Step, ...] = ()
    chosen: dict[str, Choice] = plainest
    if not all(search.within(each) for each in deviations.values()):
        steps = _steps(search)
        chosen, deviations = _together(search, _affordable(search, steps), steps)
    samplers = _samplers(search, chosen)
    chosen = _cheapest_samplers(chosen, samplers)
    return _result(search, chosen, steps, samplers, deviations)


def _plainest(search: _Search) -> dict[str, Choice]:
    choices = dict(search.richest)
    for name, material in search.named.items():
        for axis in AXES:
            for option in search.options(material, axis)[:1]:
                choices[name] = with_option(material, choices[name], axis, option)
    return choices


def _steps(search: _Search) -> tuple[Step, ...]:
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


def _affordable(search: _Search, steps: tuple[Step, ...]) -> dict[str, Choice]:
    """Per material and axis the plainest option that alone is within the tolerance."""
    choices = dict(search.richest)
    for axis in AXES:
        for step in reversed(steps):  # the plainest is taken last
            if step.axis == axis and search.within(step.deviation):
                material = search.named[step.material]
                choices[step.material] = with_option(material, choices[step.material], axis, step.option)
    return choices


def _together(
    search: _Search, choices: dict[str, Choice], steps: tuple[Step, ...]
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


def _samplers(search: _Search, chosen: dict[str, Choice]) -> tuple[Sampler, ...]:
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
            if sampler == "normals" and ns >= search.cost(name, choice):
                continue
            if other_density:
                base = base or search.whole(chosen)
                pictures[sampler] = pictures.get(sampler) or search.whole(_all_with(search, chosen, sampler))
                region = search.regions[name]
                noise = float(pictures[sampler].variance[region].mean() / base.variance[region].mean())
            found.append(Sampler(name, sampler, ns, noise))
    return tuple(found)


def _all_with(search: _Search, chosen: dict[str, Choice], sampler: str) -> dict[str, Choice]:
    return {
        name: replace(choice, sampler=sampler)
        if sampler in materials.samplers(build.kind_of(search.named[name], choice))
        else choice
        for name, choice in chosen.items()
    }


def _cheapest_samplers(chosen: dict[str, Choice], samplers: tuple[Sampler, ...]) -> dict[str, Choice]:
    best = dict(chosen)
    for name in chosen:
        mine = [each for each in samplers if each.material == name]
        if mine:
            best[name] = replace(chosen[name], sampler=min(mine, key=lambda each: each.ns * each.noise).sampler)
    return best


def _result(search: _Search, chosen, steps, samplers, deviations) -> Result:
    search.say("the richest and the chosen, timed")
    pictures = {"richest": search.whole(search.richest), "chosen": search.whole(chosen)}
    effort = {name: each.ns_per_sample * float(each.variance.mean()) for name, each in pictures.items()}
    faster = effort["richest"] / effort["chosen"]
    settled = search.scene, search.tolerance, search.richest, chosen, steps, samplers, deviations, pictures
    return Result(*settled, faster)
