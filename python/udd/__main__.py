"""`python -m udd` is the command `udd`."""

from __future__ import annotations

import sys

from .cli import main

sys.exit(main())
