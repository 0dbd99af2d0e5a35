"""Old name of :mod:`udd.related_systems`; it works for one release more."""

import warnings

from udd.related_systems import *  # noqa: F403

warnings.warn("udd.relatives is called udd.related_systems now", DeprecationWarning, stacklevel=2)
