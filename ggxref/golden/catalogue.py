"""The functions that have vectors: arguments, what each argument is drawn as, formula, source, error budget."""

from dataclasses import dataclass, field, replace


@dataclass(frozen=True)
class Function:
    """A public function of one point.

    - `arguments`: argument name -> the quantity of `inputs.draw` that it is given;
    - `base`: roundings on the longest path of a good form in the working dtype, an elementary function counted twice and
      an inversion four times; the vectors' `ulp` adds what the inputs cause (`budget`);
    - `note`: what an implementation is free to choose;
    - `above`: arguments that must lie above the horizon;
    - `options`: keyword arguments that are no numbers;
    - `derivative`: the argument of a gradient. The result is then the vector of the value and all partial derivatives.
    """

    name: str
    arguments: dict[str, str]
    statement: str
    source: str
    base: int
    note: str = ""
    above: tuple[str, ...] = ()
    options: dict[str, str] = field(default_factory=dict)
    derivative: str = ""

    @property
    def id(self) -> str:
        """The name and what tells two of one name apart: the stem of the vectors' file."""
        return ".".join([self.name, *self.options.values(), *([f"d_{self.derivative}"] if self.derivative else [])])


def gradient(function: Function, argument: str) -> Function:
    """The entry for the value and gradient of a function. Its chain rule about triples the roundings."""
    note = ""
    if function.arguments[argument] == "wm":
        note = (
            "The direction is normalised first: the gradient lies in its tangent plane. Of an answer, that part counts."
        )
    statement = rf"(f, \partial f/\partial {argument}), f = {function.statement}"
    base = 3 * function.base
    return replace(function, derivative=argument, statement=statement, base=base, note=note)


def entry(signature: str, base: int, statement: str, source: str, **domain) -> Function:
    """From `"masking.g1_ggx(w=wi, wm, alpha)"`: `w` is drawn as the quantity `wi`, the others under their own names."""
    name, _, arguments = signature.rstrip(")").partition("(")
    pairs = (argument.strip().partition("=") for argument in arguments.split(","))
    return Function(name, {key: quantity or key for key, _, quantity in pairs}, statement, source, base, **domain)
