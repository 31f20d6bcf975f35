"""Pictures of a scene under choices of its models, each rendered once, and what the formulas of a choice cost."""

from collections.abc import Callable, Hashable, Mapping
from dataclasses import replace
from functools import cached_property

from ggxref.scene import build, compare, materials, render
from ggxref.scene.build import Choice
from ggxref.scene.compare import Batches, Deviation
from ggxref.scene.materials import FRESNELS, G2S, PRECISIONS, TURNS
from ggxref.scene.read import MOST, Material, Scene

AXES = {
    "model": build.MODELS,
    "g2": G2S[:2],
    "fresnel": FRESNELS,
    "trigonometry": tuple(TURNS),
    "precision": tuple(PRECISIONS),
}
"""Options of each axis, plainest first. V-cavities are another microsurface, not a plainer one."""
COUNT = 8
"""Batches: enough for an error of the error of 27 %."""
TRIAL = 8
"""Samples a pixel and batch that tell how long a sample takes."""
MORE = 4
"""Once, that many times the samples where an answer is within its error of the tolerance."""

Choices = Mapping[str, Choice]


class Search:
    """Pictures of one scene, each rendered once. `say` is told what is done next."""

    def __init__(self, scene: Scene, tolerance: float, say: Callable[[str], None]):
        self.scene, self.tolerance, self.say = scene, tolerance, say
        self.settings = render.Settings(scene.width, scene.height)
        self.named = {material.name: material for material in scene.materials}
        self.richest = {name: build.richest(material) for name, material in self.named.items()}
        self.regions = {name: region for name, region in build.seen(scene).items() if region.any()}
        self._references: dict[int, Batches] = {}
        self._clock = compare.Clock()
        self._costs: dict[Hashable, float] = {}

    def _batches(self, choices: Choices, samples: int, *, by_row: bool = True, seed: int = 0) -> Batches:
        kinds, world = build.world(self.scene, choices, by_row=by_row)
        return compare.batches(kinds, world, self.settings, count=COUNT, samples=samples, seed=seed)

    @cached_property
    def samples(self) -> int:
        """Samples a pixel of a batch: those of the file, or what fits in its seconds."""
        if not self.scene.seconds:
            return max(self.scene.samples // COUNT, 2)
        ns = self._batches(self.richest, TRIAL).ns_per_sample
        pixels = self.scene.width * self.scene.height * COUNT
        return min(max(int(self.scene.seconds * 1e9 / (ns * pixels)), 2), MOST // pixels)

    @property
    def bright(self) -> bool:
        """Whether the richest picture has any light."""
        return bool(self._reference(self.samples).mean.any())

    def _reference(self, samples: int) -> Batches:
        if samples not in self._references:
            self._references[samples] = self._batches(self.richest, samples)
        return self._references[samples]

    def measure(self, choices: Choices) -> dict[str, Deviation]:
        """From the richest, per material; with more samples where the first leave it open."""
        found: dict[str, Deviation] = {}
        for samples in (self.samples, MORE * self.samples):
            found = compare.deviations(self._batches(choices, samples), self._reference(samples), self.regions)
            if not any(each.least < self.tolerance <= each.most for each in found.values()):
                break
        return found

    def within(self, deviation: Deviation) -> bool:
        """Strictly: within 0 is nothing, so tolerance 0 keeps the richest."""
        return deviation.most < self.tolerance

    def options(self, material: Material, axis: str) -> tuple[str, ...]:
        """What is plainer than the material's richest on an axis."""
        fixed = {"dielectric": ("fresnel",), "diffuse": tuple(AXES)}.get(material.surface, ())
        if axis in fixed or (axis == "trigonometry" and self.richest[material.name].sampler not in materials.TURNING):
            return ()
        every = AXES[axis]
        return every[: every.index(getattr(self.richest[material.name], axis))]

    def cost(self, name: str, choice: Choice) -> float:
        """Of a bounce's formulas [ns]. Stored precision costs memory, not formulas.

        A form of G2, of Fresnel or of trigonometry is a small part, timed by itself: compiled with the rest, it would be
        lost in what the compiler makes of the rest.
        """
        richest = self.richest[name]
        forms = {axis: (getattr(richest, axis), getattr(choice, axis)) for axis in compare.USES}
        richer = replace(choice, precision=richest.precision, **{axis: rich for axis, (rich, _) in forms.items()})
        kind, (rows,) = self._kind(name, richer)
        ns = self._once(kind, lambda: self._clock.bounce(kind, rows))
        for axis, options in forms.items():
            if len(set(options)) > 1:
                rich, plain = (
                    self._once((axis, each), lambda: self._clock.part(axis, each, rows))  # noqa: B023
                    for each in options
                )
                ns += plain - rich
        return ns

    def _kind(self, name: str, choice: Choice) -> tuple[materials.Kind, tuple[materials.Rows, ...]]:
        kinds, world = build.world(_alone(self.scene, self.named[name]), {name: choice})
        return kinds[0], world.rows

    def _once(self, key: Hashable, measure: Callable[[], float]) -> float:
        if key not in self._costs:
            self._costs[key] = measure()
        return self._costs[key]

    def whole(self, choices: Choices, samples: int, seed: int = 0) -> Batches:
        """With the formulas compiled for these choices alone: what they cost. What rounds to a stored precision is left out."""
        choices = {name: replace(choice, precision="float32") for name, choice in choices.items()}
        return self._batches(choices, samples, by_row=False, seed=seed)


def _alone(scene: Scene, material: Material) -> Scene:
    """The scene with one material, and only the shapes that have it."""
    shapes = tuple(shape for shape in scene.shapes if shape["material"] == material.name)
    return replace(scene, materials=(material,), shapes=shapes)
