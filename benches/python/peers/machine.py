"""Which machine this is, and what must be set before numba, jax and heyoka are imported."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = (
    "udd", "scipy", "numba", "heyoka", "jitcode", "diffrax", "jax", "pydiffsol", "pynamicalsys", "numpy",
)  # fmt: skip


def settle() -> None:
    """Two threads at most, one for linear algebra; full-width SIMD for numba where there is AVX-512."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    os.environ.setdefault("NUMBA_NUM_THREADS", "2")
    os.environ.setdefault("JAX_ENABLE_X64", "1")
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    try:
        from llvmlite import binding
    except ImportError:
        return
    features = binding.get_host_cpu_features()
    if features.get("avx512f") and "NUMBA_CPU_FEATURES" not in os.environ:
        # LLVM holds back to half of a register on these processors; the lanes are a third faster without.
        os.environ["NUMBA_CPU_NAME"] = binding.get_host_cpu_name()
        os.environ["NUMBA_CPU_FEATURES"] = features.flatten() + ",-prefer-256-bit"


def processor() -> str:
    """The processor's name, the cores there are, and the widest SIMD instructions."""
    name, flags = platform.processor() or platform.machine(), ""
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text().splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name":
                name = value.strip()
            elif key.strip() == "flags":
                flags = value
    simd = next((s for s, f in (("AVX-512", "avx512f"), ("AVX2", "avx2")) if f in flags.split()), "")
    return f"{name}, {os.cpu_count()} cores" + (f", {simd}" if simd else "")


def versions() -> dict[str, str]:
    """The versions of what takes part."""
    results = {}
    for package in PACKAGES:
        try:
            results[package] = version(package)
        except PackageNotFoundError:
            results[package] = "not installed"
    return results
