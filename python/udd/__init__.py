"""The laboratory of the upward-driven disk.

Film the device, measure its motion, fit the model, find what the model lacks, and explore the
dynamics.
"""

from __future__ import annotations

import lazy_loader

# __init__.pyi lists the public names. A module is imported when it is first used, so `import udd` is fast.
_attribute, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

#: Old names, which keep working for one release.
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
