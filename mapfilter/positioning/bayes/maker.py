"""What made a Bayes map filter of options, to make it again of others over the same area."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mapfilter.positioning.bayes.area.area_frame import AreaFrame
    from mapfilter.positioning.bayes.filter import BayesPositioner

_OF_OPTIONS = ("model", "carriageways", "maker")
"""Parts that no two filters share, as each makes them of its options."""


@dataclass(frozen=True, eq=False)
class Maker:
    """The options of a filter, and what makes filters over its area.

    Parameters
    ----------
    options : BayesFilter
        As they were given.
    make : callable
        Makes a filter of options.
    """

    options: Any
    make: Callable[[Any], BayesPositioner]

    def remade(self, bound: BayesPositioner, options: Any) -> BayesPositioner:
        """Return a filter by other options, with what was replaced in this one since it was made.

        Parameters
        ----------
        bound : BayesPositioner
            Which this one made; other rules, or sources of evidence, may have been given to it.
        """
        before, names = self.make(self.options), [one.name for one in fields(bound)]
        replaced = {
            name: getattr(bound, name)
            for name in names
            if name not in _OF_OPTIONS and getattr(bound, name) != getattr(before, name)
        }
        return replace(self.make(options), **replaced)


def made_over_area(area: AreaFrame, options: Any) -> BayesPositioner:
    """Return the filter of options over an area."""
    made: BayesPositioner = options.over_area(area)
    return made
