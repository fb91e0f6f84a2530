"""Registers the plugins with Mitsuba, for each variant once."""

import functools

import mitsuba as mi

from . import llvm
from .errors import PluginError

_classes = {}


def register():
    """Registers the plugins for the current variant. Importing `glint_ndf.mitsuba` does it, and `mi.set_variant` does it from then
    on; call it yourself after a change of the variant that does not go through `mi.set_variant`.
    """
    variant = mi.variant()
    if variant is None or variant in _classes:
        return
    from . import bsdf, integrator

    if mi.is_polarized:
        for name, add in ((bsdf.NAME, mi.register_bsdf), (integrator.NAME, mi.register_integrator)):
            add(name, _refuse_polarization(name))
        return
    classes = {"bsdf": bsdf.make_class(), "integrator": integrator.make_class()}
    _classes[variant] = classes
    mi.register_bsdf(bsdf.NAME, lambda props: classes["bsdf"](props))
    mi.register_integrator(integrator.NAME, lambda props: classes["integrator"](props))


def _refuse_polarization(name):
    def construct(props):
        raise PluginError(name, "polarized variants are not supported; take one without polarization, such as llvm_ad_rgb")

    return construct


def watch_variants():
    """Makes `mi.set_variant` register the plugins."""
    original = mi.set_variant
    if getattr(original, "registers_glint", False):
        return

    @functools.wraps(original)
    def set_variant(*variants):
        if any(name.startswith("llvm") for name in variants):
            llvm.warn_if_missing()
        original(*variants)
        register()

    set_variant.registers_glint = True
    mi.set_variant = set_variant
