"""Evidence as odds."""

from __future__ import annotations

import math

_RAISED = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
_MOST = 100  # powers of ten: no model of the noise is right that far out
_POWER = str(_MOST).translate(_RAISED)


def odds(nats: float) -> str:
    """Return evidence in nats (units of log-likelihood) as odds: ``10⁷ to 1``.

    >>> odds(2.0), odds(10.0), odds(-16.0)
    ('7.39 to 1', '10⁴ to 1', '1 to 10⁷')
    >>> odds(16_000.0)
    'more than 10¹⁰⁰ to 1'
    """
    power = nats / math.log(10.0)
    if abs(power) < 3.0:
        return f"{math.exp(nats):.3g} to 1" if power >= 0 else f"1 to {math.exp(-nats):.3g}"
    if abs(power) > _MOST:
        return f"more than 10{_POWER} to 1" if power > 0 else f"less than 1 to 10{_POWER}"
    raised = f"10{f'{abs(power):.0f}'.translate(_RAISED)}"
    return f"{raised} to 1" if power > 0 else f"1 to {raised}"
