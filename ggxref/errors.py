"""The one error that bad input raises."""


class InputError(ValueError):
    """Input that cannot be used. The message is one line: where, what was got, and why that will not do."""
