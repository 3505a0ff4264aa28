"""Compiled kernels are read from the disk without what numba needs to compile.

Before numba reads a compiled function, it imports all that it can compile, scipy's linear algebra
included, and compiles functions of its own: half a second and 35 MiB, of which a finished kernel
uses the addresses of some symbols. The kernels given to :func:`load_alone` do without. Other
functions, and those of these kernels that are yet to be compiled, find numba as it always is.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

from llvmlite import binding
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.runtime._nrt_python import c_helpers


def load_alone(kernel: Any) -> None:
    """Let a function that numba compiles, with the option ``cache``, be read in this way."""
    if hasattr(kernel, "py_func"):  # not where numba is switched off
        kernel._cache = _Store(kernel.py_func)


class _Entry(CompileResultCacheImpl):
    """What is stored of a compiled function, with the symbols that it refers to."""

    def reduce(self, cres: Any) -> Any:
        # the annotated source is for readers
        *others, environments = super().reduce(cres._replace(type_annotation=""))
        # one without constants is never read, and would import the module of its function
        used = tuple(environment for environment in environments if environment.consts)
        return tuple(_symbols(cres.library._final_module)), (*others, used)

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        symbols, reduced = payload
        _name_runtime()
        if any(binding.address_of_symbol(name) is None for name in symbols):
            target_context.refresh()  # a symbol without an address would end the process
        return super().rebuild(target_context, reduced)

    def get_filename_base(self, fullname: str, abiflags: str) -> str:
        return f"alone-{super().get_filename_base(fullname, abiflags)}"


class _Store(FunctionCache):
    """The store of a function, which does not prepare numba for compiling before it is read."""

    _impl_class = _Entry

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


@cache
def _name_runtime() -> None:
    """Give the linker the addresses of numba's runtime, as numba does before it compiles."""
    for name, address in c_helpers.items():
        binding.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)


def _symbols(module: Any) -> Iterator[str]:
    """Names of the functions and variables that a compiled module uses without defining them."""
    for value in (*module.functions, *module.global_variables):
        if value.is_declaration and not value.name.startswith("llvm."):
            yield value.name
