"""Answers from a program of any language: questions on its standard input, answers on its standard output."""

import os
import shlex
import signal
import subprocess
import tempfile
import time
from dataclasses import dataclass

from ggxref.errors import InputError
from ggxref.golden import text
from ggxref.golden.reading import Test

# A program that prints more than so many bytes a question prints garbage.
MOST_BYTES = 4096
POLL_SECONDS = 0.02


@dataclass(frozen=True)
class Ran:
    """What a program answered, and what went wrong with it (nothing: an empty string)."""

    answers: text.Answers
    trouble: str


def run(command: str, tests: list[Test], seconds: float) -> Ran:
    """Start the program, hand it all questions, and wait for at most so many seconds."""
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise InputError(f"--command: {command!r}: {error}") from None
    if not words:
        raise InputError("--command: no program")
    with tempfile.TemporaryFile() as questions, tempfile.TemporaryFile() as output:
        for group in text.groups(tests):
            questions.write(text.questions(*group).encode("ascii"))
        questions.seek(0)
        try:
            process = subprocess.Popen(words, stdin=questions, stdout=output, start_new_session=True)
        except OSError as error:
            raise InputError(f"--command: {words[0]!r} cannot be started: {error.strerror}") from None
        try:
            trouble = supervised(process, output.fileno(), seconds, MOST_BYTES * (len(tests) + 1))
        finally:
            if process.poll() is None:
                # The program may be a shell with children: its session goes with it.
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        output.seek(0)
        lines = (line.decode("ascii", "replace") for line in output.read(MOST_BYTES * (len(tests) + 1)).splitlines())
        answers, garbage = text.answers(lines, tests)
        return Ran(answers, "; ".join(filter(None, [trouble, garbage and f"printed garbage: {garbage}"])))


def supervised(process: subprocess.Popen, output: int, seconds: float, most: int) -> str:
    """Wait for the program; what went wrong, if anything."""
    end = time.monotonic() + seconds
    while process.poll() is None:
        if time.monotonic() > end:
            return f"still running after {seconds:g} s, stopped"
        if os.fstat(output).st_size > most:
            return f"printed more than {most} bytes, stopped"
        time.sleep(POLL_SECONDS)
    code = process.returncode
    if code < 0:
        return f"crashed with {signal.Signals(-code).name}"
    return f"ended with exit code {code}" if code else ""
