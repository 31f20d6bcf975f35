"""The functions that have vectors: arguments, what each argument is drawn as, formula, source, error budget."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Function:
    """A public function of one point.

    - `arguments`: argument name -> the quantity of `inputs.draw` that it is given;
    - `base`: roundings on the longest path of a good form in the working dtype, an elementary function counted twice and
      an inversion four times; the vectors' `ulp` adds what the inputs cause (`budget`);
    - `note`: what an implementation is free to choose;
    - `above`: arguments that must lie above the horizon;
    - `options`: keyword arguments that are no numbers.
    """

    name: str
    arguments: dict[str, str]
    statement: str
    source: str
    base: int
    note: str = ""
    above: tuple[str, ...] = ()
    options: dict[str, str] = field(default_factory=dict)

    @property
    def id(self) -> str:
        """The name, and the options that tell two of one name apart: the stem of the vectors' file."""
        return ".".join([self.name, *self.options.values()])


def entry(signature: str, base: int, statement: str, source: str, **domain) -> Function:
    """From `"masking.g1_ggx(w=wi, wm, alpha)"`: `w` is drawn as the quantity `wi`, the others under their own names."""
    name, _, arguments = signature.rstrip(")").partition("(")
    pairs = (argument.strip().partition("=") for argument in arguments.split(","))
    return Function(name, {key: quantity or key for key, _, quantity in pairs}, statement, source, base, **domain)
