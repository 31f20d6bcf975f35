"""The command line: six verbs, and the only file that sees every part of the package."""

import signal
import sys

import typer

from ggxref.errors import InputError

app = typer.Typer(
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
    """Run the command line: exit code 2 and one line for bad input, 130 for Ctrl-C."""
    signal.signal(signal.SIGINT, _interrupted)
    try:
        app()
    except InputError as error:
        print(f"ggxref: {error}", file=sys.stderr)
        raise SystemExit(2) from None
