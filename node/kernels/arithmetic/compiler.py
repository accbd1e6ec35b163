"""All that leans on numba's private modules, in one place: no other file of ours imports them.

Documented of numba are ``njit``, ``config``, ``types`` and ``numba.extending``. What stands here is not, and may be
gone with any release, so its tests (tests/node/test_compiler.py) run with the numba that is installed and with the
lowest that pyproject.toml allows. What each part buys:

* ``ConstantType``: what stands around the filter is written once and compiled for floats and for integers, constants
  and all. The alternative is every such module twice.
* ``ByAddress``: a kernel that calls a node's step needs no copy of it (``benchmarks/by_address.py``).
* ``NO_WRAPPER``: kernels that are never called through a C pointer are compiled without code for that.
* ``ONLY_BORROWED``: kernels count no references to the arrays that they are given, which took a quarter of a node's
  step; one that would make an array is refused as it is compiled.
* ``kept_where``: a kept function is known by our sources and not by the date of its file.
* ``telling_compiled``: one who waits is told how far the compiler is.
* ``leave_blas_out``: a process starts a quarter of a second sooner.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from typing import Any, Final, cast

import numba
from numba import config, types
from numba.core import event
from numba.core.caching import UserProvidedCacheLocator
from numba.core.imputils import lower_constant
from numba.core.typeconv.castgraph import Conversion
from numba.core.types import FunctionType, WrapperAddressProtocol
from numba.core.typing.typeof import Purpose
from numba.extending import lower_cast, models, overload, register_model, typeof_impl

__all__ = [
    "COUNTED",
    "NO_WRAPPER",
    "ONLY_BORROWED",
    "ByAddress",
    "ConstantType",
    "UserProvidedCacheLocator",
    "is_argument",
    "kept_where",
    "leave_blas_out",
    "telling_compiled",
]

FORMS: Final = (types.float64, types.int64)
NO_WRAPPER: Final[dict[str, Any]] = {"no_cfunc_wrapper": True}
ONLY_BORROWED: Final[dict[str, Any]] = {"_nrt": False}  # the caller owns every array, so none may be returned either
COUNTED: Final[dict[str, Any]] = {"_nrt": True}


class ConstantType(types.Opaque):
    """Type of one constant, as numba knows it: it becomes the float or the integer of what it meets.

    It has to meet something: alone, as under a minus, numba takes it for the integer.
    """

    def __init__(self, value: float, fixed: int) -> None:
        self.value, self.fixed = value, fixed
        super().__init__(f"Constant({value!r}, {fixed})")

    def can_convert_to(self, _: Any, other: Any) -> Any:
        """To the two forms and to nothing else."""
        return Conversion.safe if other in FORMS else None

    def unify(self, _: Any, other: Any) -> Any:
        """The form of the other branch."""
        return other if other in FORMS else None


register_model(ConstantType)(models.OpaqueModel)


@lower_constant(ConstantType)  # type: ignore[no-untyped-call]
def _lower(context: Any, _builder: Any, _type: Any, _value: Any) -> Any:
    return context.get_dummy_value()


@lower_cast(ConstantType, types.float64)  # type: ignore[no-untyped-call]
def _to_float(context: Any, _builder: Any, kind: ConstantType, _to: Any, _value: Any) -> Any:
    return context.get_constant(types.float64, kind.value)


@lower_cast(ConstantType, types.int64)  # type: ignore[no-untyped-call]
def _to_integer(context: Any, _builder: Any, kind: ConstantType, _to: Any, _value: Any) -> Any:
    return context.get_constant(types.int64, kind.fixed)


@overload(min, strict=False)
def _least(a: Any, b: Any) -> Any:
    if isinstance(a, ConstantType) or isinstance(b, ConstantType):
        return lambda a, b: b if b < a else a
    return None


@overload(max, strict=False)
def _most(a: Any, b: Any) -> Any:
    if isinstance(a, ConstantType) or isinstance(b, ConstantType):
        return lambda a, b: b if b > a else a
    return None


def is_argument(context: Any) -> bool:
    """Whether a value whose type is asked for, with this context, is handed to a kernel by Python."""
    return context.purpose is Purpose.argument


class ByAddress(WrapperAddressProtocol):
    """An ``entry`` compiled for the types of ``arguments``, as a value that a kernel takes and calls."""

    def __init__(self, function: Any, *arguments: Any) -> None:
        kinds = tuple(map(numba.typeof, arguments))
        function.compile(kinds)
        compiled = function.overloads[kinds]
        self._signature = compiled.signature
        self.kind = FunctionType(compiled.signature)
        self._address = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_cfunc_wrapper_name)

    def __wrapper_address__(self) -> int:
        """Where the code is."""
        return cast("int", self._address)

    def signature(self) -> Any:
        """What it takes and returns, as numba says it."""
        return self._signature


@typeof_impl.register(ByAddress)
def _kind_of(value: ByAddress, _: Any) -> FunctionType:
    """Its type, made once: numba would make it anew in every call, which takes longer than the call."""
    return value.kind


@contextlib.contextmanager
def kept_where(locator: type[Any]) -> Iterator[None]:
    """Have numba keep what is declared inside where ``locator`` says, and other people's functions where it did."""
    before = vars(config)["CACHE_LOCATOR_CLASSES"]
    vars(config)["CACHE_LOCATOR_CLASSES"] = f"{locator.__module__}.{locator.__name__}"
    try:
        yield
    finally:
        vars(config)["CACHE_LOCATOR_CLASSES"] = before


class _Compilations(event.Listener):
    """Tells of every function that is compiled and not loaded, as it begins and ends."""

    def __init__(self, began: Callable[[], object], ended: Callable[[], object]) -> None:
        self._began, self._ended = began, ended

    def on_start(self, event: Any) -> None:
        """A function is compiled."""
        del event
        self._began()

    def on_end(self, event: Any) -> None:
        """It is."""
        del event
        self._ended()


@contextlib.contextmanager
def telling_compiled(began: Callable[[], object], ended: Callable[[], object]) -> Iterator[None]:
    """Have ``began`` and ``ended`` called around every function that is compiled meanwhile, those within others too."""
    listener = _Compilations(began, ended)
    event.register("numba:compile", listener)  # type: ignore[no-untyped-call]
    try:
        yield
    finally:
        event.unregister("numba:compile", listener)  # type: ignore[no-untyped-call]


def leave_blas_out() -> None:
    """Have numba load without a BLAS: for a process of ours, whose kernels multiply by themselves.

    Numba imports ``scipy.linalg`` as it compiles or loads its first function, a quarter of a second of every start, and
    holds that none is there where the import fails. Not for an interpreter that runs foreign code too.
    """
    name = "scipy.linalg"
    if name in sys.modules:
        return
    sys.modules[name] = cast("Any", None)  # so an import of it fails
    try:
        import numba.np.arraymath  # noqa: F401  numba looks for the BLAS once, as it imports this
    finally:
        del sys.modules[name]
