"""What stands for numba in a process that compiles nothing: kernels run as the Python that they are.

A board whose step is the C library calls a few small kernels a cycle, around the step, and needs no compiler for them:
numba and LLVM take over a second of every start and 140 MB. Functions that numba takes by the types of their arguments
are written for floats and told what integers take in their place: as they stand they are those of the float64 record.

Only what the kernels import is here; anything else of numba is an AttributeError.
"""

from __future__ import annotations

import enum
import functools
import platform
import sys
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any, Final

from node.uncompiled.record_views import view_of

VERSION: Final = "0, no compiler"  # in the digest that names the folder of what is compiled
DEFAULTS: Final = {"CACHE_DIR": "", "CACHE_LOCATOR_CLASSES": "", "CPU_NAME": "", "CPU_FEATURES": ""}


class StandInError(ImportError):
    """Numba is in the process already."""


def run_as_python(function: Any = None, **_: Any) -> Any:
    """Run a kernel as Python, which sees records as numba shows them."""
    if function is None:
        return run_as_python

    @functools.wraps(function)
    def run(*given: Any, **named: Any) -> Any:
        return function(*map(view_of, given), **named)

    run.py_func = function  # type: ignore[attr-defined]  # as numba has it
    return run


def declare_nothing(*_: Any, **__: Any) -> Callable[[Any], Any]:
    """Take a decorator of numba's extensions: what it declares is for the compiler."""
    return lambda declared: declared


class _Kind:
    def __init__(self, *_: Any) -> None:
        """Take a name, as numba's types do."""


class _Purpose(enum.Enum):
    argument = 1


def _kinds() -> dict[str, Any]:
    names = ("Opaque", "Float", "Integer", "Record", "FunctionType", "WrapperAddressProtocol")
    made: dict[str, Any] = {name: type(name, (_Kind,), {}) for name in names}
    return made | {"float64": made["Float"](), "int64": made["Integer"]()}


def stand_in_modules() -> dict[str, dict[str, Any]]:
    """Names of each module of numba and LLVM that the kernels import from."""
    kinds, config = _kinds(), SimpleNamespace(**DEFAULTS)
    registry = SimpleNamespace(register=declare_nothing)
    extending = dict.fromkeys(("lower_cast", "overload", "register_model"), declare_nothing)
    return {
        "numba": {
            "__version__": VERSION,
            "config": config,
            "njit": run_as_python,
            "types": SimpleNamespace(**kinds),
            "typeof": type,
        },
        "numba.core": {"event": SimpleNamespace(Listener=object)},
        "numba.core.caching": {"UserProvidedCacheLocator": object},
        "numba.core.imputils": {"lower_constant": declare_nothing},
        "numba.core.typeconv.castgraph": {"Conversion": SimpleNamespace(safe=1)},
        "numba.core.types": kinds,
        "numba.core.typing.typeof": {"Purpose": _Purpose},
        "numba.extending": extending | {"models": SimpleNamespace(OpaqueModel=object), "typeof_impl": registry},
        "numba.np": {},
        "numba.np.arraymath": {},
        "llvmlite": {},
        "llvmlite.binding": {"get_host_cpu_name": platform.machine},
    }


def stand_in_for_numba() -> None:
    """Have kernels that are imported from now on run as Python.

    Raises
    ------
    StandInError
        When numba is in the process: what it has compiled already would meet what it has not.
    """
    if "numba" in sys.modules:
        raise StandInError("numba: expected a process that has not imported it, got one that has")
    for name, names in stand_in_modules().items():
        module = ModuleType(name)
        vars(module).update(names)
        sys.modules[name] = module
        above, _, own = name.rpartition(".")
        if above in sys.modules and own not in vars(sys.modules[above]):
            setattr(sys.modules[above], own, module)
