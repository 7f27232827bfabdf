"""A C function `void f(const mjModel*, mjData*)` called from Numba by its address.

The address is an argument, so that kernels which call it can be kept in Numba's cache; the address of a `ctypes`
function would be a constant of the compiled code, other in every process.
"""

from __future__ import annotations

from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.extending import intrinsic


@intrinsic
def call_native(typing_context, address, model, data):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Call the function at `address` with the addresses of a model and its data."""
    signature = types.void(types.intp, types.intp, types.intp)

    def code(context, builder, _, arguments):  # type: ignore[no-untyped-def]
        word = context.get_value_type(types.intp)
        function = ir.FunctionType(ir.VoidType(), (word, word))
        builder.call(builder.inttoptr(arguments[0], function.as_pointer()), arguments[1:])
        return context.get_dummy_value()

    return signature, code
