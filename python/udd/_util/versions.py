"""Versions that made a result."""

from __future__ import annotations


def version_of(name: str) -> str:
    """Return a package's version."""
    from importlib.metadata import PackageNotFoundError, version  # takes longer than all else of a help

    try:
        return version(name)
    except PackageNotFoundError:
        return "(of unknown version)"


def versions(*names: str) -> str:
    """Return the versions of packages, of Python and of the machine, on which numbers may depend."""
    import platform  # takes milliseconds, of a program's start too

    packages = ", ".join(f"{name} {version_of(name)}" for name in names)
    return f"{packages}, Python {platform.python_version()} on {platform.system()} {platform.machine()}"
