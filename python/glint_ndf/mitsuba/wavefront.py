"""Switches Dr.Jit to evaluated loops and calls, which a BSDF written in Python needs.

The BSDF asks the library with numpy arrays, so directions must be numbers when it is called. In a symbolic loop or call they are
only variables of a kernel that runs later.
"""

import contextlib

import drjit as dr
import mitsuba as mi

from .errors import PluginError

_FLAGS = ("SymbolicLoops", "SymbolicCalls", "SymbolicConditionals")


@contextlib.contextmanager
def wavefront():
    """Context in which loops, calls and conditionals are evaluated at once. Restores the flags afterwards.

    Scalar variants need no flags; there the context does nothing.
    """
    if not is_jit():
        yield
        return
    before = {name: dr.flag(getattr(dr.JitFlag, name)) for name in _FLAGS}
    try:
        for name in _FLAGS:
            dr.set_flag(getattr(dr.JitFlag, name), False)
        yield
    finally:
        for name, value in before.items():
            dr.set_flag(getattr(dr.JitFlag, name), value)


def is_jit():
    """Whether the current variant compiles kernels (llvm_*, cuda_*)."""
    return dr.is_jit_v(mi.Float)


def require_numbers(plugin):
    """Raises an error where a BSDF is called inside a symbolic loop or call."""
    if is_jit() and dr.flag(dr.JitFlag.SymbolicScope):
        raise PluginError(
            plugin,
            "this BSDF is written in Python and needs evaluated loops and calls. Render with glint_ndf.mitsuba.render(scene),"
            " with the integrator `glint_path`, or inside `with glint_ndf.mitsuba.wavefront():`",
        )


def render(scene, *arguments, **keywords):
    """mi.render inside `wavefront()`; same arguments, same answer. Works with any integrator."""
    with wavefront():
        image = mi.render(scene, *arguments, **keywords)
        if is_jit():
            dr.eval(image)
        return image
