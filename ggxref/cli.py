"""The command line: six verbs, and the only file that sees every part of the package."""

import signal
import sys

import typer
from typer.core import TyperGroup

from ggxref.errors import InputError


class _Verbs(TyperGroup):
    """The verbs, with bad input turned into one line and exit code 2."""

    def invoke(self, ctx: typer.Context):
        try:
            return super().invoke(ctx)
        except InputError as error:
            print(f"ggxref: {error}", file=sys.stderr)
            raise typer.Exit(2) from None


app = typer.Typer(
    cls=_Verbs,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    help="A research toolkit and reference oracle for GGX microfacet models.",
)


@app.callback()
def _root() -> None:
    """Several verbs, also while there is only one."""


def _interrupted(signum: int, frame: object) -> None:
    print("ggxref: interrupted", file=sys.stderr)
    raise SystemExit(130)


def main() -> None:
    signal.signal(signal.SIGINT, _interrupted)  # before the libraries, whose own answer to Ctrl-C is a traceback
    app()
