"""One run of the checks by several processes, on one machine or many, through `jax.distributed`.

Each process runs every n-th ordinary check; the streamed ones all run together, each process its share of the blocks.
Checks are seeded by their names and block sums are added exactly, so the records are those of one process, bit for bit,
where the processors are alike: the compiler may round differently for another instruction set.
"""

import json
import os
from collections.abc import Sequence
from dataclasses import asdict

import jax
import numpy as np
from jax.experimental import multihost_utils

from ggxref.errors import InputError
from ggxref.verify.engine import Check, Control, Record


def use_all_cores() -> None:
    """One JAX device a core, unless JAX has started already: then those that there are."""
    try:
        jax.config.update("jax_num_cpu_devices", os.cpu_count() or 1)
    except RuntimeError:
        return


def join(where: str) -> None:
    """Enter the run: `HOST:PORT,COUNT,RANK`, the address of process 0, the number of processes, and which one this is."""
    try:
        address, count, rank = where.split(",")
        host, port = address.rsplit(":", 1)
        numbers = int(port), int(count), int(rank)
    except ValueError:
        raise InputError(f"--distributed: {where!r} is not HOST:PORT,COUNT,RANK as in 127.0.0.1:9000,2,0") from None
    if not host or not 0 < numbers[0] < 1 << 16 or not 0 <= numbers[2] < numbers[1]:
        raise InputError(f"--distributed: {where!r}: PORT is 1 to 65535 and RANK 0 to COUNT - 1")
    jax.distributed.initialize(address, numbers[1], numbers[2], cluster_detection_method="deactivate")


def first() -> bool:
    """Whether this is the process that reports."""
    return jax.process_index() == 0


def share(checks: Sequence[Check]) -> list[Check]:
    """The ordinary checks that fall to this process."""
    return [c for c in checks if not c.thorough][jax.process_index() :: jax.process_count()]


def gathered(records: Sequence[Record], checks: Sequence[Check]) -> list[Record]:
    """The records of all processes in the order of the checks, in each process."""
    if jax.process_count() > 1:
        sent = json.dumps([asdict(r) for r in records]).encode()
        length = int(np.max(multihost_utils.process_allgather(np.array([len(sent)]))))
        # JSON may end in spaces.
        rows = multihost_utils.process_allgather(np.frombuffer(sent.ljust(length), np.uint8))
        records = [_record(value) for row in np.asarray(rows) for value in json.loads(row.tobytes())]
    # The streamed checks come from every process, all alike but for their seconds: the last one's are kept.
    found = {(r.paper, r.equation, r.statement): r for r in records}
    return [found[c.paper, c.equation, c.statement] for c in checks]


def _record(value):
    return Record(**{**value, "control": Control(**value["control"])})
