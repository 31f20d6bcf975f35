"""Output that an interrupted run leaves whole or not at all."""

import os
import tempfile
from pathlib import Path

from ggxref.errors import InputError


def writable(option: str, path: Path | None) -> None:
    """That a file can be made at `path`; to be asked before the work whose result it takes."""
    if path and (path.is_dir() or not path.parent.is_dir()):
        why = "it is a directory" if path.is_dir() else f"there is no directory {path.parent}"
        raise InputError(f"{option}: {path} cannot be written: {why}")


def writable_directory(option: str, path: Path | None) -> None:
    """That `path` is a directory, or that one can be made there; to be asked before the work whose result it takes."""
    if path and not path.is_dir() and (path.exists() or not path.parent.is_dir()):
        why = "it is a file" if path.exists() else f"there is no directory {path.parent}"
        raise InputError(f"{option}: {path} cannot be written: {why}")


def write_atomically(path: Path | str, data: bytes | str) -> None:
    """Write `data` (text as UTF-8) under a temporary name beside `path`, then rename it over `path`."""
    path = Path(path)
    handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data.encode() if isinstance(data, str) else data)
        # mkstemp makes the file private; give it the permissions that `open` would have.
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(temporary, 0o666 & ~mask)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise
