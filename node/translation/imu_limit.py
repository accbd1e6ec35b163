"""The records of a node with fewer IMUs than this program's: for a chip, whose memory is small.

How many IMUs a record has room for is one constant, and records are made of it as their modules are imported. So a
process of its own imports them with another number, and writes the C there.
"""

from __future__ import annotations

import ast
import importlib.util
import json
import pickle
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from node.translation.c_file import CFiles

MODULE, CONSTANT = "node.kernels.record.sensor_record", "MAX_IMUS"


def write_for_imus(count: int) -> CFiles:
    """The step in C for nodes of up to ``count`` IMUs, 1 to ``MAX_IMUS``.

    Raises
    ------
    UntranslatableKernelError
        When a kernel says what is not translated.
    """
    from node.kernels.record.sensor_record import MAX_IMUS
    from node.translation.c_file import CFiles, write_c_files
    from node.translation.kernel_source import UntranslatableKernelError

    if count == MAX_IMUS:
        return write_c_files()
    command = [sys.executable, "-P", "-m", "node.translation.imu_limit", str(count)]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode != 0:
        raise UntranslatableKernelError(done.stderr.strip().rpartition("\n")[2])
    header, code, digest, entries = json.loads(done.stdout)
    return CFiles(header, code, digest, tuple(entries))


def record_kinds(count: int) -> tuple[Any, Any, Any]:
    """Dtypes of settings, parameters and record of a node in integers with room for ``count`` IMUs."""
    if count == import_module(MODULE).MAX_IMUS:
        kinds = _own_kinds()
    else:
        command = [sys.executable, "-P", "-m", "node.translation.imu_limit", str(count), "kinds"]
        kinds = pickle.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    return kinds


def _own_kinds() -> tuple[Any, Any, Any]:
    from node.kernels.record.integer_node import FIXED_NODE, FIXED_PARAMETERS, FIXED_SETTINGS

    return FIXED_SETTINGS, FIXED_PARAMETERS, FIXED_NODE


def limit_imus(count: int) -> None:
    """Have the records of this process, none of which is imported yet, made for ``count`` IMUs."""
    spec = importlib.util.find_spec(MODULE)
    assert spec is not None
    assert spec.origin is not None
    module = importlib.util.module_from_spec(spec)
    tree = ast.parse(Path(spec.origin).read_text(encoding="utf-8"))
    for statement in tree.body:
        if isinstance(statement, ast.AnnAssign) and ast.unparse(statement.target) == CONSTANT:
            statement.value = ast.copy_location(ast.Constant(count), statement)
    sys.modules[MODULE] = module
    exec(compile(tree, spec.origin, "exec"), module.__dict__)
    package, _, name = MODULE.rpartition(".")
    setattr(import_module(package), name, module)


def _main() -> None:
    limit_imus(int(sys.argv[1]))
    if sys.argv[2:] == ["kinds"]:
        sys.stdout.buffer.write(pickle.dumps(_own_kinds()))
        return
    from node.translation.c_file import write_c_files

    sys.stdout.write(json.dumps(write_c_files()))


if __name__ == "__main__":
    _main()
