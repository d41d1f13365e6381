"""When and how the Rao-Blackwellised particle filter draws its particles anew."""

from __future__ import annotations

from dataclasses import dataclass

from mapfilter.errors import Faults, InputError


@dataclass(frozen=True, slots=True)
class SirOptions:
    """How particles are drawn anew.

    Parameters
    ----------
    resample_below : float
        Share of the effective sample size under which particles are drawn anew; 1 does so at every
        reading (sampling importance resampling, SIR).
    regularise : float
        Width of the kernel that parts copies, as a share of the best one for normal beliefs
        (Musso, Oudjane & Le Gland 2001); 0 for none.
    """

    resample_below: float = 1.0
    regularise: float = 0.0

    def __post_init__(self) -> None:
        faults = Faults()
        if not 0 <= self.resample_below <= 1:
            faults.add("SIR, resample_below", "a share in 0..1", self.resample_below)
        if not 0 <= self.regularise <= 2:
            faults.add("SIR, regularise", "a share in 0..2", self.regularise)
        faults.raise_if_any(InputError)


SIR = SirOptions()
"""Drawn anew at every reading."""

REGULARISED = SirOptions(0.5, 0.5)
"""Drawn anew where half of the particles carry the weight, copies parted."""
