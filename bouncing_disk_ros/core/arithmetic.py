"""Arithmetic with the same bits on every processor: own sine, cosine, exact sums and products.

No function of the C library is called but the square root, the floor and the fused multiply-add,
which IEEE 754 defines to the last bit; nothing here may be compiled with fastmath.
"""

from __future__ import annotations

import gc
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeAlias

from numba import njit, types
from numba.core.caching import FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.codegen import ll as llvm
from numba.core.compiler import Compiler
from numba.core.runtime import rtsys
from numba.core.types.functions import BaseFunction
from numba.extending import intrinsic

Kernel: TypeAlias = Callable[..., Any]

TWO_PI = 2.0 * math.pi
GIGA = 1e9
"""Nanoseconds of a second, for kernels."""
TWO_OVER_PI = 2.0 / math.pi
# π/2 in parts: the first two have 33 bits, so that their product with |k| < 2²⁰ is exact.
HALF_PI_1 = float.fromhex("0x1.921fb54400000p+0")
HALF_PI_2 = float.fromhex("0x1.0b4611a600000p-34")
HALF_PI_3 = float.fromhex("0x1.3198a2e037073p-69")
_HALF_PI_HIGH = math.pi / 2
_QUARTER_PI = math.pi / 4
_HALF_PI_LOW = float.fromhex("0x1.1a62633145c07p-54")
_FEW_TURNS = 1.0e6  # below it k < 2²⁰
ROUNDER = 1.5 * 2.0**52  # adding and subtracting it rounds to the nearest whole number

# Taylor coefficients: on |r| ≤ π/4 the first neglected term is below 5e-17 (sine) and 2e-18
# (cosine).
S3, S5, S7 = -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0
S9, S11, S13, S15 = (
    1.0 / 362880.0,
    -1.0 / 39916800.0,
    1.0 / 6227020800.0,
    -1.0 / 1307674368000.0,
)
C4, C6, C8, C10 = 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40320.0, -1.0 / 3628800.0
C12, C14, C16 = 1.0 / 479001600.0, -1.0 / 87178291200.0, 1.0 / 20922789888000.0


# ------------------------------------------------------------------------------------------------
# How numba compiles the kernels. By itself numba optimises each inner function again in each
# caller, and links all callees into each function. Its passes over closures, overloads and array
# expressions change nothing in a kernel. For each `a * b` it tries all functions of that operator,
# array functions first. Without this work a first start takes two thirds of the processor time.


_NEEDLESS = {
    "AnnotateTypes",
    "DumpParforDiagnostics",
    "FindLiterallyCalls",
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
IRLegalization ends the life of variables, which is of use where arrays are counted."""


class InnerLibrary(JITCodeLibrary):
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
    """Remember which function numba found for an operator of numbers; no looks for cycles.

    Looks for cycles would take a sixth of the time.
    """
    known: dict[Any, Any] = {}
    functions: Any = BaseFunction
    find = functions.get_call_type

    def remembered(function: Any, context: Any, given: Any, keywords: Any) -> Any:
        if keywords or not all(isinstance(one, types.Number | types.Boolean) for one in given):
            return find(function, context, given, keywords)
        key = function, given
        if key not in known:
            known[key] = find(function, context, given, keywords)
        return known[key]

    collects = gc.isenabled()
    gc.disable()
    functions.get_call_type = remembered
    try:
        yield
    finally:
        functions.get_call_type = find
        if collects:
            gc.enable()


class QuickCache(FunctionCache):
    """numba's cache of an entry's machine code, loaded without the tables of its compiler.

    They take 0.2 s. A compilation makes them.
    """

    def load_overload(self, signature: object, context: Any) -> Any:
        """Return the entry with this signature; None: it is not stored."""
        rtsys.initialize(context)  # what the code calls for its arrays
        with self._guard_against_spurious_io_errors():
            return self._load_overload(signature, context)


def kernel(function: Kernel) -> Kernel:
    """Compile an inner function of the core, inlined; entry points are compiled with `entry`.

    It makes and returns no array, and does not count who holds those that it is given.
    """
    return _inner(function, inlined=True, _nrt=False)


def rare_kernel(function: Kernel) -> Kernel:
    """Compile an inner function that runs seldom: called, not inlined, for a short compilation."""
    return _inner(function, inlined=False)  # not None: numba would do as with the first caller


def _inner(function: Kernel, *, inlined: bool, **options: bool) -> Kernel:
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


def entry(*signature: object) -> Callable[[Kernel], Kernel]:
    """Compile a function that Python calls: one signature, cached, without the GIL."""
    from bouncing_disk_ros.kernel_cache import share_compiled_kernels

    def compile_entry(function: Kernel) -> Kernel:
        share_compiled_kernels()
        with _quick_compilation():
            compiled: Any = njit(
                error_model="numpy", nogil=True, cache=True, no_cfunc_wrapper=True
            )(function)
            compiled._cache = QuickCache(function)
            compiled.compile(*signature)
            compiled.disable_compile()
        return compiled

    return compile_entry


@kernel
def two_sum(a: float, b: float) -> tuple[float, float]:
    """a + b as the rounded sum and its exact error (Knuth)."""
    total = a + b
    t = total - a
    return total, (a - (total - t)) + (b - t)


@intrinsic
def _fused(_typing: Any, _a: Any, _b: Any, _c: Any) -> Any:
    """a b + c, rounded once: by the processor, or by the C library where it cannot.

    Only for results that are exact, which have the same bits in every way to compute them.
    """

    def generate(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        return builder.fma(*given)

    return types.float64(types.float64, types.float64, types.float64), generate


@kernel
def two_product(a: float, b: float) -> tuple[float, float]:
    """a b as the rounded product and its exact error; |a b| below 1e308, and 0 or above 1e-290."""
    p = a * b
    return p, _fused(a, b, -p)


@kernel
def pair_sum(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Sum of two double-double numbers."""
    total, e = two_sum(ah, bh)
    return two_sum(total, e + (al + bl))


@kernel
def pair_product(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Product of two double-double numbers."""
    p, e = two_product(ah, bh)
    return two_sum(p, e + (ah * bl + al * bh))


@kernel
def pair_quotient(ah: float, al: float, b: float) -> tuple[float, float]:
    """Quotient of a double-double number and a float64."""
    q = ah / b
    p, e = two_product(q, b)
    return two_sum(q, ((ah - p) - e + al) / b)


@kernel
def _reduced(x: float) -> tuple[float, int]:
    """Remainder of x after the nearest multiple k of π/2, |r| ≤ π/4, and k modulo 4."""
    quadrant = (x * TWO_OVER_PI + ROUNDER) - ROUNDER
    if abs(x) < _FEW_TURNS:
        r = ((x - quadrant * HALF_PI_1) - quadrant * HALF_PI_2) - quadrant * HALF_PI_3
    else:
        r, quadrant = _far_remainder(x, quadrant)
    return r, int(quadrant) & 3


@rare_kernel
def _far_remainder(x: float, quadrant: float) -> tuple[float, float]:
    """x − kπ/2 and k for a large x: x·2/π is rounded, so k may be one off at the first look."""
    r = _remainder(x, quadrant)
    quadrant += 1.0 if r > _QUARTER_PI else (-1.0 if r < -_QUARTER_PI else 0.0)
    return _remainder(x, quadrant), quadrant


@kernel
def _remainder(x: float, quadrant: float) -> float:
    """x − kπ/2, rounded once."""
    p, e = two_product(quadrant, _HALF_PI_HIGH)
    high, low = two_sum(x - p, -e)
    return high + (low - quadrant * _HALF_PI_LOW)


@kernel
def excesses(r: float) -> tuple[float, float]:
    """sin r − r and cos r − 1 for |r| ≤ π/4, to a few ulp of themselves (Estrin's order)."""
    z = r * r
    z2 = z * z
    z4 = z2 * z2
    p = ((S3 + S5 * z) + z2 * (S7 + S9 * z)) + z4 * ((S11 + S13 * z) + z2 * S15)
    q = ((C4 + C6 * z) + z2 * (C8 + C10 * z)) + z4 * ((C12 + C14 * z) + z2 * C16)
    return (r * z) * p, z2 * q - 0.5 * z


@kernel
def sincos(x: float) -> tuple[float, float]:
    """sin x and cos x, absolute error below 2e-16 for |x| < 1e15."""
    r, quadrant = _reduced(x)
    se, ce = excesses(r)
    s = r + se
    c = 1.0 + ce
    swap = quadrant & 1
    p = c if swap else s
    q = s if swap else c
    return (-p if quadrant & 2 else p), (-q if (quadrant + 1) & 2 else q)


@entry(types.UniTuple(types.float64, 2)(types.float64))
def sine_and_cosine(x: float) -> tuple[float, float]:
    """`sincos` for Python: cached, so that a start does not compile it."""
    return sincos(x)


@kernel
def sincos_excess(x: float) -> tuple[float, float, float, float]:
    """sin x, cos x, sin x − x and cos x − 1; the last two keep their digits for small x."""
    if abs(x) <= 0.78:
        se, ce = excesses(x)
        return x + se, 1.0 + ce, se, ce
    s, c = sincos(x)
    return s, c, s - x, c - 1.0


@rare_kernel
def arcsine(c: float) -> float:
    """Angle in [0, π/2] whose sine is c in [0, 1]: a fit (error 7e-5), then Newton steps."""
    x = 0.5 * math.pi - math.sqrt(1.0 - c) * (
        1.5707288 + c * (-0.2121144 + c * (0.0742610 - c * 0.0187293))
    )
    for _ in range(3):
        sine, cosine = sincos(x)
        if cosine > 1e-8:
            x += (c - sine) / cosine
    return x


@kernel
def arccosine(c: float) -> float:
    """Angle in [0, π/2] whose cosine is c in [0, 1], to 2e-16 or so."""
    steep = c > 0.75  # there the arcsine of c itself has few digits
    x = arcsine(math.sqrt((1.0 - c) * (1.0 + c)) if steep else c)
    return x if steep else 0.5 * math.pi - x


@kernel
def wrapped(x: float) -> float:
    """x in [0, 2π) taken into it by whole turns, for x in (−2π, 4π)."""
    if x >= TWO_PI:
        x -= TWO_PI
    elif x < 0.0:
        x += TWO_PI
    if x >= TWO_PI or x < 0.0:
        return 0.0
    return x


@rare_kernel
def shortest_angle(t: float, phase: float) -> float:
    """Shortest angular distance of an angle t from a phase, in [−π, π]."""
    off = t - phase
    return off - TWO_PI * math.floor(off / TWO_PI + 0.5)
