"""How numba compiles the kernels: `kernel`, `rare_kernel` and `entry`.

By itself numba optimises each inner function again in each caller, and links all callees into each
function. Its passes over closures, overloads and array expressions change nothing in a kernel. For
each `a * b` it tries all functions of that operator, array functions first. Without this work a
first start takes two thirds of the processor time. Nothing may be compiled with fastmath.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from typing import Any, TypeAlias

from numba import njit, types
from numba.core import event, utils
from numba.core.caching import FunctionCache
from numba.core.codegen import JITCodeLibrary, llvmir
from numba.core.codegen import ll as llvm
from numba.core.compiler import Compiler
from numba.core.runtime import rtsys
from numba.core.types.functions import BaseFunction

Kernel: TypeAlias = Callable[..., Any]

_NEEDLESS = {
    "AnnotateTypes",
    "DumpParforDiagnostics",
    "FindLiterallyCalls",
    "IRProcessing",
    "InlineClosureLikes",
    "InlineInlinables",
    "InlineOverloads",
    "LiteralPropagationSubPipelinePass",
    "LiteralUnroll",
    "MakeFunctionToJitFunction",
    "NoPythonSupportedFeatureValidation",
    "NopythonRewrites",
    "RewriteDynamicRaises",
    "RewriteSemanticConstants",
    "WithLifting",
}
"""numba's passes for closures, array expressions and literal types: inner functions have none.

A later pass refuses a function with closures; array expressions compute the same with more code.
ReconstructSSA does again what IRProcessing does.
IRLegalization ends the life of variables, which is of use where arrays are counted."""


class ScalarLibrary(JITCodeLibrary):
    """LLVM code for one trajectory at a time: without AVX-512, where the processor has it.

    Its comparisons go through mask registers: `Simulation.advance` takes a sixth longer.
    """

    _codegen: Any

    def add_ir_module(self, ir_module: Any) -> None:
        """Take the code of a function, for the processor's other instructions."""
        _triple, _processor, features = self._codegen.magic_tuple()
        if "+avx512f" in features:
            for function in ir_module.functions:
                if not function.is_declaration:
                    add_attribute(function, "target-features", f"{features},-avx512f")
        super().add_ir_module(ir_module)


def add_attribute(function: Any, name: str, value: str) -> None:
    """Add an attribute for LLVM to a function of llvmlite, whose own `add` takes no values."""
    set.add(function.attributes, f'"{name}"="{value}"')


class InnerLibrary(ScalarLibrary):
    """LLVM code of an inner function alone: no machine code, which nobody would run.

    An entry links it with all that it calls, and optimises everything once.
    """

    _final_module: Any
    _shared_module: Any

    def add_llvm_module(self, module: Any) -> None:
        """Take the code of the function: the only module of this library."""
        self._optimize_functions(module)
        self._final_module = module

    def finalize(self) -> None:
        """Link and optimise nothing: the entry does."""
        self._finalize_dynamic_globals()
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        """Return the code, with functions that may be linked into many others."""
        if self._shared_module is None:
            for function in self._final_module.functions:
                if not function.is_declaration and function.linkage == llvm.Linkage.external:
                    function.linkage = "linkonce_odr"
            self._shared_module = self._final_module
        return self._shared_module

    def with_callees(self) -> list[JITCodeLibrary]:
        """Return the libraries that a caller must link: this one and its callees'."""
        return list(dict.fromkeys([self, *self._linking_libraries]))

    def get_pointer_to_function(self, _name: str) -> int:
        """Return 0: no such function in machine code."""
        return 0

    @property
    def codegen(self) -> InnerLibrary:
        """What sets an environment for Python objects: this library, which has none."""
        return self

    def set_env(self, _name: str, _environment: object) -> None:
        """Do nothing: compiled code without Python objects reads no environment."""


class EntryCompiler(Compiler):
    """numba's compiler for functions that Python calls, which work on one trajectory at a time."""

    def define_pipelines(self) -> list[Any]:
        """Return numba's passes; they fill a ScalarLibrary."""
        state = self.state
        state.library = ScalarLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        found: list[Any] = super().define_pipelines()
        return found


class InnerCompiler(Compiler):
    """numba's compiler for functions that only compiled functions call."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes that an inner function needs, once each; they fill an InnerLibrary."""
        state = self.state
        state.library = InnerLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        found: list[Any] = super().define_pipelines()
        needless = _NEEDLESS if state.flags.nrt else _NEEDLESS | {"IRLegalization"}
        for pipeline in found:
            pipeline.passes = [
                one for one in dict(pipeline.passes).items() if one[0].__name__ not in needless
            ]
        return found

    def compile_extra(self, function: Any) -> Any:
        """Compile a function; TypeError for one that returns an array and does not count it."""
        found = super().compile_extra(function)
        if not self.state.flags.nrt and _holds_array(found.signature.return_type):
            raise TypeError(f"{function.__name__} returns an array: declare it as rare_kernel")
        context, library = self.state.targetctx, self.state.library
        context.remove_user_function(found.entry_point)
        context.insert_user_function(found.entry_point, found.fndesc, library.with_callees())
        return found


def _holds_array(kind: types.Type) -> bool:
    """Whether a type is that of an array, or of a tuple with one in it."""
    if isinstance(kind, types.BaseTuple):
        return any(_holds_array(one) for one in kind)
    return isinstance(kind, types.Array)


@contextmanager
def _quick_compilation() -> Iterator[None]:
    """Remember what numba looks up again and again; no events of locks, no looks for cycles.

    What is remembered: functions for operators of numbers, sizes of types, signatures of numba's
    own functions. Each call of LLVM has two events, and each open compilation a timer for them.
    """
    known: dict[Any, Any] = {}
    find = BaseFunction.get_call_type

    def remembered(function: Any, context: Any, given: Any, keywords: Any) -> Any:
        if keywords or not all(isinstance(one, types.Number | types.Boolean) for one in given):
            return find(function, context, given, keywords)
        key = function, given
        if key not in known:
            known[key] = find(function, context, given, keywords)
        return known[key]

    collects = gc.isenabled()
    gc.disable()
    try:
        with ExitStack() as replaced:
            for owner, name, quick in (
                (BaseFunction, "get_call_type", remembered),
                (llvmir.Type, "get_abi_size", cache(llvmir.Type.get_abi_size)),
                (utils, "pysignature", cache(utils.pysignature)),
                (event, "start_event", _of_compilations(event.start_event)),
                (event, "end_event", _of_compilations(event.end_event)),
            ):
                replaced.callback(setattr, owner, name, getattr(owner, name))
                setattr(owner, name, quick)
            yield
    finally:
        if collects:
            gc.enable()


def _of_compilations(send: Callable[..., None]) -> Callable[..., None]:
    """numba's function that sends an event, for events of compilations alone."""

    def sent(kind: str, *arguments: Any, **named: Any) -> None:
        if kind == "numba:compile":
            send(kind, *arguments, **named)

    return sent


class QuickCache(FunctionCache):
    """numba's cache of an entry's machine code, loaded without the tables of its compiler.

    They take 0.2 s. A compilation makes them. What a loss of power or a full disk left is compiled
    again.
    """

    def load_overload(self, signature: object, context: Any) -> Any:
        """Return the entry with this signature; None: it is not stored, or cannot be read."""
        rtsys.initialize(context)  # what the code calls for its arrays
        with self._guard_against_spurious_io_errors():
            try:
                return self._load_overload(signature, context)
            except Exception:  # noqa: BLE001 (pickle and LLVM raise anything on damaged bytes)
                from bouncing_disk_ros.kernel_cache import forget_kernel

                forget_kernel(self._cache_file._index_path)
                return None

    def save_overload(self, signature: object, data: Any) -> None:
        """Store a compiled entry; where that fails, warn."""
        try:
            super().save_overload(signature, data)
        except OSError as error:
            from bouncing_disk_ros.kernel_cache import warn_of_storing

            warn_of_storing(error.strerror)


def kernel(function: Kernel) -> Kernel:
    """Compile an inner function of the core, inlined; entry points are compiled with `entry`.

    It makes and returns no array, and does not count who holds those that it is given.
    """
    return inner(function, inlined=True, _nrt=False)


def rare_kernel(function: Kernel) -> Kernel:
    """Compile an inner function that runs seldom: called, not inlined, for a short compilation."""
    return inner(function, inlined=False)  # not None: numba would do as with the first caller


def inner(function: Kernel, *, inlined: bool, **options: Any) -> Kernel:
    """Let numba compile what only compiled functions call, to LLVM code (`InnerLibrary`).

    Once for all integers, not again for each literal one.
    """
    compiled: Any = njit(
        error_model="numpy", nogil=True, no_cpython_wrapper=True, no_cfunc_wrapper=True,
        forceinline=inlined, pipeline_class=InnerCompiler, **options,
    )(function)  # fmt: skip
    template = compiled.get_call_template

    def template_of_types(given: tuple[Any, ...], keywords: Any) -> Any:
        return template(tuple(types.unliteral(one) for one in given), keywords)

    compiled.get_call_template = template_of_types
    found: Kernel = compiled
    return found


def entry(*signature: object, scalar: bool = True, **options: bool) -> Callable[[Kernel], Kernel]:
    """Compile a function that Python calls, or load it as an earlier process has compiled it.

    One signature, without the GIL. `scalar`: it works on one trajectory at a time (ScalarLibrary).
    """
    from bouncing_disk_ros.kernel_cache import share_compiled_kernels

    def compile_entry(function: Kernel) -> Kernel:
        share_compiled_kernels()
        compiled: Any = njit(
            error_model="numpy", nogil=True, no_cfunc_wrapper=True, cache=True,
            pipeline_class=EntryCompiler if scalar else Compiler, **options,
        )(function)  # fmt: skip
        compiled._cache = QuickCache(function)
        with _quick_compilation():
            compiled.compile(*signature)
        compiled.disable_compile()
        found: Kernel = compiled
        return found

    return compile_entry
