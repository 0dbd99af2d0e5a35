"""The laboratory of the upward-driven disk.

Film the device, get its motion, fit the model, find what the model lacks, and explore what the
model does.
"""

from __future__ import annotations

import lazy_loader

# The public names stand in __init__.pyi. Nothing is imported before it is used: `import udd` stays fast.
_attribute, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

#: Names of before, which work for one release more.
_RENAMED = {"energy_books": "energy_balance", "relatives": "related_systems"}


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version

        return version("udd")
    if name in _RENAMED:
        import warnings

        text = f"udd.{name} is called udd.{_RENAMED[name]} now"
        warnings.warn(text, DeprecationWarning, stacklevel=2)
        name = _RENAMED[name]
    if name not in __all__:
        raise AttributeError(f"module 'udd' has no attribute {name!r}")
    return _attribute(name)
