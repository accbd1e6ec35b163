"""Kernels compiled whole: LLVM sees what a rig calls once, and not once more for every function inside it.

Numba optimises every function that it compiles and makes machine code of it, a kernel that another one calls too, with
all that it calls in turn; each caller then does so again with the whole below it. A node's step is 450 functions, of
which a rig calls two. Here a function that is compiled for another one stays as it was lowered, and only what was
called from outside is optimised and kept, with all below it in one piece. Nothing in a float depends on it: numba
neither contracts nor reorders them.

For a process that compiles and ends (``kernel_parts``): it leans on numba's private modules like
``node.kernels.arithmetic.compiler``, and its test runs with the lowest numba that is allowed too.
"""

from __future__ import annotations

import gc
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

from llvmlite.binding import ffi
from numba.core.caching import FunctionCache
from numba.core.codegen import CPUCodeLibrary
from numba.core.cpu import CPUContext
from numba.core.dispatcher import Dispatcher
from numba.core.lowering import BaseLower
from numba.core.targetconfig import TargetConfig
from numba.core.types import Record


class _Depth:
    """How many functions are being compiled, each for the one before; whether the innermost is for another."""

    def __init__(self) -> None:
        self.count = 0

    @property
    def is_inner(self) -> bool:
        """Whether what is compiled now is not called from outside."""
        return self.count > 1


@contextmanager
def compiled_whole() -> Iterator[None]:
    """Have numba optimise and keep, of all that is compiled meanwhile, what is called from outside alone."""
    depth = _Depth()
    with (
        _outer_alone(depth),
        patch.object(CPUCodeLibrary, "add_linking_library", _add_library),
        patch.object(CPUCodeLibrary, "finalize", _finalize_whole(CPUCodeLibrary.finalize)),
        _cheap_bookkeeping(),
    ):
        yield


@contextmanager
def _outer_alone(depth: _Depth) -> Iterator[None]:
    """No machine code, no wrapper for Python and no place in the cache for what is compiled for another function."""
    compile_one: Any = Dispatcher.compile
    add: Any = Dispatcher.add_overload
    make: Any = CPUContext.get_executable
    wrap: Any = BaseLower.create_cpython_wrapper
    save: Any = FunctionCache.save_overload
    inner: dict[Any, list[Any]] = {}  # arguments for which a function was compiled for another

    def compile_counted(self: Any, sig: Any) -> Any:
        if depth.count == 0:
            _forget(self, inner.pop(self, ()))  # it is called from outside now
        depth.count += 1
        try:
            return compile_one(self, sig)
        finally:
            depth.count -= 1

    def add_overload(self: Any, made: Any) -> None:
        if type(made.entry_point) is object:
            arguments = tuple(made.signature.args)
            inner.setdefault(self, []).append(arguments)
            self.overloads[arguments] = made
        else:
            add(self, made)

    def get_executable(self: Any, library: Any, fndesc: Any, env: Any) -> Any:
        return object() if depth.is_inner else make(self, library, fndesc, env)

    def create_wrapper(self: Any, release_gil: bool = False) -> None:
        if not depth.is_inner:
            wrap(self, release_gil)

    def save_overload(self: Any, sig: Any, made: Any) -> None:
        if type(made.entry_point) is not object:
            save(self, sig, made)

    with (
        patch.object(Dispatcher, "compile", compile_counted),
        patch.object(Dispatcher, "add_overload", add_overload),
        patch.object(CPUContext, "get_executable", get_executable),
        patch.object(BaseLower, "create_cpython_wrapper", create_wrapper),
        patch.object(FunctionCache, "save_overload", save_overload),
    ):
        yield
    for function, given in inner.items():
        _forget(function, given)


def _forget(function: Any, given: Iterable[Any]) -> None:
    """Have a function compiled anew where it is called with one of these kinds of arguments."""
    for arguments in given:
        del function.overloads[arguments]


def _add_library(self: Any, library: Any) -> None:
    """Link ``library`` later, as it is."""
    self._linking_libraries.append(library)


def _finalize_whole(finalize: Any) -> Any:
    """Linking that takes in all below a function and not only what it calls itself."""

    def finalize_whole(self: Any) -> None:
        self._linking_libraries = [_Linked(library) for library in _all_below(self)]
        finalize(self)
        for function in self._final_module.functions:
            if function.is_declaration and function.name.startswith("_ZN"):
                raise AssertionError(f"{self.name}: expected all that it calls, {function.name} is not there")

    return finalize_whole


class _Linked:
    """One library as ``finalize`` takes it; what was only lowered is linked as it is."""

    def __init__(self, library: Any) -> None:
        self._library = library
        self._reload_init: Any = getattr(library, "_reload_init", set())  # the lowest numba allowed has none yet

    def _get_module_for_linking(self) -> Any:
        if self._library._finalized:
            return self._library._get_module_for_linking()
        module = self._library._final_module
        for function in module.functions:
            if not function.is_declaration and function.linkage.name == "external":
                function.linkage = "linkonce_odr"
        return module


def _all_below(library: Any) -> list[Any]:
    """All that a library needs, once each; what is optimised already holds all of its own.

    A caller stands before what it calls: the linker leaves out what nothing has asked for yet.
    """
    met: set[int] = set()
    found: list[Any] = []

    def visit(one: Any) -> None:
        for below in () if one._finalized else one._linking_libraries:
            if id(below) not in met:
                met.add(id(below))
                visit(below)
                found.append(below)

    visit(library)
    return found[::-1]


@contextmanager
def _cheap_bookkeeping() -> Iterator[None]:
    """Without what numba does for its own statistics: a call back for each of LLVM's functions, texts of types."""
    kept = ffi.lib._lock._cblist[:]
    shown: Any = Record.__repr__
    are_equal: Any = TargetConfig.__eq__
    said: dict[int, tuple[Any, str]] = {}

    def say_once(self: Any) -> str:
        if id(self) not in said:
            said[id(self)] = self, shown(self)
        return said[id(self)][1]

    def is_same(self: Any, other: Any) -> Any:
        return True if self._values == getattr(other, "_values", None) else are_equal(self, other)

    ffi.lib._lock._cblist.clear()
    gc.disable()
    try:
        with (
            patch.object(Record, "__repr__", say_once),
            patch.object(TargetConfig, "__eq__", is_same),
            patch.object(TargetConfig, "__hash__", lambda self: hash(type(self))),  # numba's is that of all names
        ):
            yield
    finally:
        gc.enable()
        ffi.lib._lock._cblist.extend(kept)
