"""Which cell serves: layer-3 filtering, event A3 with hysteresis and time to trigger, load offsets.

After 3GPP TS 36.331: measurements are filtered by ``F = (1 - a) F' + a M`` with ``a = 1 / 2^(k/4)``
every 200 ms. A neighbour is handed over to once event A3 has held for the time to trigger without a
break: its filtered level and its offset exceed those of the serving cell by more than the
hysteresis. Cell individual offsets balance load; networks set them anew as load changes (TR
36.902). A handover back within a few seconds is a ping-pong (TR 36.839), here also for load.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Ge, Le

from mapfilter._types import Bools, Floats, Ints
from mapfilter.options import NotNegative, Options, Positive, Share

_STEP_DB = 0.5
_SOONEST_S, _LATEST_S = 1.0, 4.0


@dataclass(frozen=True, slots=True)
class HandoverModel(Options):
    """Parameters of mobility; defaults are common in LTE networks.

    Parameters
    ----------
    tick_s : float
        Between two measurements of layer 1.
    filter_k : float
        Filter coefficient k of layer 3; 0 for no filter.
    hysteresis_db : float
        By how much a neighbour must exceed the serving cell.
    time_to_trigger_s : float
        For how long.
    load_sd_db : float
        Standard deviation of the cell individual offsets of a journey, rounded to 0.5 dB, at most
        6 dB.
    ping_pong : float
        Share of the handovers that are taken back 1 to 4 s later.

    Raises
    ------
    ConfigError
        With every value that is out of range.
    """

    tick_s: Positive = 0.2
    filter_k: Annotated[float, Ge(0), Le(19)] = 4.0
    hysteresis_db: NotNegative = 3.0
    time_to_trigger_s: NotNegative = 0.32
    load_sd_db: NotNegative = 1.5
    ping_pong: Share = 0.05


def filtered_db(level_dbm: Floats, filter_k: float) -> Floats:
    """Return levels after layer-3 filtering; a cell's first measurement is taken as it is.

    Parameters
    ----------
    level_dbm : (N, cells) array
        One row for each tick; -inf where a cell is not received, which restarts its filter.

    Examples
    --------
    >>> filtered_db(np.array([[-60.0], [-80.0], [-80.0]]), 4.0).ravel().tolist()
    [-60.0, -70.0, -75.0]
    """
    fresh = 0.5 ** (filter_k / 4)
    found = level_dbm.copy()
    for i in range(1, len(found)):
        known = np.isfinite(found[i - 1]) & np.isfinite(found[i])
        mixed = (1 - fresh) * found[i - 1][known] + fresh * found[i][known]
        found[i, known] = mixed
    return found


def load_offsets_db(count: int, model: HandoverModel, rng: np.random.Generator) -> Floats:
    """Draw the cell individual offsets of a journey, shape (count,)."""
    drawn = rng.normal(0.0, 1.0, count) * model.load_sd_db
    return np.asarray(np.clip(np.round(drawn / _STEP_DB) * _STEP_DB, -6.0, 6.0))


def serving_cells(
    filtered_dbm: Floats,
    received: Bools,
    offset_db: Floats,
    model: HandoverModel,
    rng: np.random.Generator,
) -> Ints:
    """Return the column of the cell that serves at each tick, -1 where none is received.

    A cell that is lost is replaced at once by the strongest one, as after a radio link failure.

    Parameters
    ----------
    filtered_dbm : (N, cells) array
        From :func:`filtered_db`.
    received : (N, cells) array of bool
    offset_db : (cells,) array
        Cell individual offsets.
    rng : numpy.random.Generator
        Draws the ping-pongs.

    Examples
    --------
    >>> level = np.array([[-70.0, -80.0]] * 2 + [[-76.0, -72.0]] * 4)
    >>> model = HandoverModel(time_to_trigger_s=0.4, ping_pong=0.0)
    >>> got = np.ones(level.shape, dtype=bool)
    >>> serving_cells(level, got, np.zeros(2), model, np.random.default_rng(0)).tolist()
    [0, 0, 0, 0, 1, 1]
    """
    count, cells = filtered_dbm.shape
    ranked = np.where(received, filtered_dbm + offset_db, -np.inf)
    held_s = np.zeros(cells)
    serving = np.full(count, -1, dtype=np.int64)
    now, back_to, back_at = -1, -1, count
    for i in range(count):
        level = ranked[i]
        if now < 0 or not received[i, now]:
            now = int(np.argmax(level)) if received[i].any() else -1
            held_s[:], back_at = 0.0, count
        elif i == back_at and received[i, back_to]:
            now, back_at = back_to, count
            held_s[:] = 0.0
        else:
            better = level > level[now] + model.hysteresis_db
            held_s = np.where(better, held_s + model.tick_s, 0.0)
            # An event that has held since tick j has held for i - j ticks.
            due = better & (held_s - model.tick_s >= model.time_to_trigger_s - 1e-9)
            if due.any():
                back_to, now = now, int(np.argmax(np.where(due, level, -np.inf)))
                held_s[:], back_at = 0.0, count
                if rng.random() < model.ping_pong:
                    delay_s = rng.uniform(_SOONEST_S, _LATEST_S)
                    back_at = i + max(1, round(delay_s / model.tick_s))
        serving[i] = now
    return serving
