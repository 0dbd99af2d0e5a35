"""Results that draw themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Drawable:
    """A result with a picture."""

    def plot(self, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw the result with the function of :mod:`udd.plot` that is made for its kind.

        Parameters
        ----------
        ax : Axes, optional
            By default those of a new figure.
        **options
            Options of that function.

        Returns
        -------
        Axes
        """
        from udd.plot.by_kind import draw

        return draw(self, ax, **options)
