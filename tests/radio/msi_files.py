"""Made antenna files in the format of MSI Planet."""

from collections.abc import Sequence

import numpy as np


def cut(losses: Sequence[float] | np.ndarray, name: str) -> str:
    rows = "".join(f"{angle}\t{loss:.2f}\n" for angle, loss in enumerate(losses))
    return f"{name} {len(losses)}\n{rows}"


def panel_losses(downtilt_deg: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Losses of a panel of 65° by 7° every degree, with 25 dB from front to back."""
    angle = (np.arange(360) + 180) % 360 - 180
    horizontal = np.minimum(12 * (angle / 65.0) ** 2, 25.0)
    vertical = np.minimum(12 * ((angle - downtilt_deg) / 7.0) ** 2, 20.0)
    behind = np.minimum(12 * (((angle + downtilt_deg) % 360 - 180) / 7.0) ** 2, 20.0) + 25.0
    vertical = np.where(np.abs(angle) > 90, np.minimum(behind, 40.0), vertical)
    return horizontal, vertical


def panel(
    header: str = "NAME Panel 65/7\nFREQUENCY 1855\nGAIN 15.5 dBd\nTILT ELECTRICAL\n",
    downtilt_deg: float = 0.0,
) -> str:
    horizontal, vertical = panel_losses(downtilt_deg)
    return header + cut(horizontal, "HORIZONTAL") + cut(vertical, "VERTICAL")
