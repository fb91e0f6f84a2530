"""Finding LLVM, and registering the plugins."""

import os
import subprocess
import sys

import mitsuba as mi
import pytest
from scenes import glint

import glint_ndf.mitsuba as gm
from glint_ndf.mitsuba import llvm as finder


def test_old_versions_of_llvm_are_passed_over(tmp_path):
    for name in ("libLLVM-14.so.1", "libLLVM-16.so", "libLLVM-18.so.1", "libLLVM.so.19.1", "libLLVMSupport.so"):
        (tmp_path / name).touch()
    assert finder.find([str(tmp_path)]) == str(tmp_path / "libLLVM.so.19.1")


def test_names_without_a_version_follow_their_link(tmp_path):
    (tmp_path / "libLLVM.so.1").symlink_to(tmp_path / "libLLVM-15.so.1")
    (tmp_path / "libLLVM-15.so.1").touch()
    assert finder.find([str(tmp_path)]) is None


def test_a_missing_llvm_is_named(monkeypatch):
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)
    monkeypatch.setattr(finder, "find", lambda: None)
    monkeypatch.setattr(finder.ctypes.util, "find_library", lambda name: None)
    with pytest.warns(RuntimeWarning, match="libllvm19"):
        finder.warn_if_missing()


def test_the_user_has_the_last_word(monkeypatch):
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "/chosen/libLLVM.so")
    assert finder.prepare() == "/chosen/libLLVM.so"


def run_python(program):
    environment = {name: value for name, value in os.environ.items() if name != "DRJIT_LIBLLVM_PATH"}
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment, check=False)


def test_a_fresh_process_finds_llvm():
    done = run_python(
        "import glint_ndf.mitsuba, mitsuba as mi\nmi.set_variant('llvm_ad_rgb')\nprint(mi.load_dict({'type': 'glint_path'}))"
    )
    assert done.returncode == 0, done.stderr
    assert "GlintPath" in done.stdout


def test_a_variant_that_was_set_before_the_import():
    done = run_python(
        "import mitsuba as mi\nmi.set_variant('scalar_rgb')\nimport glint_ndf.mitsuba\nprint(mi.load_dict({'type': 'glint_path'}))"
    )
    assert done.returncode == 0, done.stderr
    assert "GlintPath" in done.stdout


def test_every_change_of_the_variant_registers(noise_pyramid):
    mi.set_variant("scalar_rgb")
    with mi.variant_context("llvm_ad_rgb"):
        assert "Glint" in str(mi.load_dict(glint(noise_pyramid)))
    assert "Glint" in str(mi.load_dict(glint(noise_pyramid)))
    gm.register()


def test_polarized_variants_are_refused(noise_pyramid):
    mi.set_variant("llvm_ad_rgb")
    with mi.variant_context("scalar_spectral_polarized"):
        with pytest.raises(Exception, match="glint.*polari"):
            mi.load_dict(glint(noise_pyramid))
