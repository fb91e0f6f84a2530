"""Switches Dr.Jit to evaluated loops and calls, which a BSDF written in Python needs.

The BSDF asks the library with numpy arrays, so directions must be numbers when it is called. In a symbolic loop or call they are
only variables of a kernel that runs later.
"""

import contextlib

import drjit as dr
import mitsuba as mi

from .errors import PluginError
from .exchange import is_jit

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


def require_numbers(plugin):
    """Raises an error where a BSDF is called inside a symbolic loop or call."""
    if is_jit() and dr.flag(dr.JitFlag.SymbolicScope):
        raise PluginError(
            plugin,
            "this BSDF is written in Python and needs evaluated loops and calls. Render with glint_ndf.mitsuba.render(scene),"
            " with the integrator `glint_path`, or inside `with glint_ndf.mitsuba.wavefront():`",
        )


def render(scene, *arguments, **keywords):
    """mi.render inside `wavefront()`; same arguments, same answer. Works with any integrator.

    Errors of the plugins are raised as they are, not inside those that Mitsuba wraps around them.
    """
    with wavefront():
        try:
            image = mi.render(scene, *arguments, **keywords)
            if is_jit():
                dr.eval(image)
            return image
        except Exception as error:
            refused = _plugin_error_in(error)
            if refused is None:
                raise
    # Outside of the handler: the exception that wraps this one must not become its context.
    raise refused


def _plugin_error_in(error):
    """The error of a plugin that an exception wraps, or None."""
    while error is not None and not isinstance(error, PluginError):
        error = error.__cause__ or error.__context__
    return error
