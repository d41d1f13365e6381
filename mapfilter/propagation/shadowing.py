"""Log-normal shadowing that is correlated in space, and in part shared by the sectors of a site.

The autocorrelation is exponential, ``exp(-d / d_c)`` (Gudmundson 1991, *Correlation model for
shadow fading in mobile radio systems*, eq. 2). Fields are drawn by circulant embedding (Dietrich &
Newsam 1997): white noise is filtered on a torus whose spectrum is that of the autocorrelation.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np

from mapfilter._types import Floats, Floats32
from mapfilter.errors import Faults, InputError, fail
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import CellPlan

_PAD_LENGTHS = 10.0
# About five arrays of 8 bytes per pixel are held at a time: 8 GiB.
_LARGEST_TORUS_PX = 8 * 2**30 // 40


def correlated_field(
    lattice: Lattice, deviation_db: float, correlation_m: float, rng: np.random.Generator
) -> Floats32:
    """Draw a zero-mean Gaussian field with correlation ``exp(-d / correlation_m)``.

    The torus is ten correlation lengths wider than the lattice, so that opposite edges are
    correlated by less than 5e-5; variance and correlation are exact otherwise.

    Parameters
    ----------
    deviation_db : float
        Standard deviation at every point.
    correlation_m : float
        Distance d_c at which the correlation is 1/e; 0 for white noise.

    Returns
    -------
    ndarray of float32, shape (rows, cols)
        dB.

    Raises
    ------
    InputError
        A parameter is negative or not finite, or the torus would take more than 8 GiB.
    """
    return _drawer(lattice, deviation_db, correlation_m)(rng)


def _drawer(
    lattice: Lattice, deviation_db: float, correlation_m: float
) -> Callable[[np.random.Generator], Floats32]:
    """Return :func:`correlated_field` as a function of the generator: fields share their spectrum.

    Raises
    ------
    InputError
    """
    _check(deviation_db, correlation_m)
    size = lattice.rows, lattice.cols
    if deviation_db == 0:
        return lambda _: np.zeros(size, dtype=np.float32)
    if correlation_m == 0:
        return lambda rng: np.asarray(deviation_db * rng.standard_normal(size), dtype=np.float32)
    length_px = correlation_m / lattice.resolution_m
    pad = int(np.ceil(_PAD_LENGTHS * length_px))
    if (lattice.rows + pad) * (lattice.cols + pad) > _LARGEST_TORUS_PX:
        side_m = np.sqrt(_LARGEST_TORUS_PX) * lattice.resolution_m
        expected = f"area and ten correlation lengths within {side_m:.0f} m, to fit into memory"
        got = f"{correlation_m:g} m, {lattice.rows} x {lattice.cols} pixels"
        hint = "a correlation length in the wrong unit, or too fine a resolution"
        raise fail(InputError, "shadowing, correlation_m", expected, got, hint)
    from scipy import fft

    shape = tuple(fft.next_fast_len(n + pad, real=True) for n in size)
    amplitude = _spectral_amplitude(shape, length_px)

    def drawn(rng: np.random.Generator) -> Floats32:
        field = fft.irfft2(amplitude * fft.rfft2(rng.standard_normal(shape)), s=shape)
        return np.asarray(deviation_db * field[: size[0], : size[1]], dtype=np.float32)

    return drawn


def site_shadowing(
    plan: CellPlan,
    lattice: Lattice,
    deviation_db: float,
    correlation_m: float,
    site_share: float,
    seed: int,
    *,
    stream: str = "shadowing",
) -> Iterator[tuple[str, Floats32]]:
    """Draw one field per cell, in part shared by the cells of a site.

    A cell's field is ``√share · (field of its site) + √(1 - share) · (its own field)``, so that
    its deviation is ``deviation_db`` and the sectors of one site are correlated by ``site_share``.
    Each part is drawn from (seed, stream, name): adding a cell changes no other.

    Parameters
    ----------
    deviation_db, correlation_m : float
        As in :func:`correlated_field`.
    site_share : float
        Share of the variance that the cells of one site have in common, 0..1.
    seed : int
        Not negative.
    stream : str
        Fields of different streams are independent, even with the same seed.

    Yields
    ------
    (str, ndarray of float32, shape (rows, cols))
        Cell id and field in dB, in the plan's order.
    """
    _check(deviation_db, correlation_m, site_share, seed)
    if not plan.cells:
        return
    drawn = _drawer(lattice, deviation_db, correlation_m)
    waiting = Counter(cell.site for cell in plan.cells)
    sites: dict[str, Floats32] = {}
    for cell in plan.cells:
        if cell.site not in sites:
            rng = named_rng(seed, stream, "site", cell.site)
            sites[cell.site] = drawn(rng)
        own = drawn(named_rng(seed, stream, "cell", cell.id))
        waiting[cell.site] -= 1
        shared = sites[cell.site] if waiting[cell.site] else sites.pop(cell.site)
        field = np.sqrt(site_share) * shared + np.sqrt(1.0 - site_share) * own
        yield cell.id, field.astype(np.float32)


def named_rng(seed: int, *names: str) -> np.random.Generator:
    """Return a generator that depends only on a seed and names, equal on every machine.

    Examples
    --------
    >>> named_rng(1, "cell", "A").integers(1000) == named_rng(1, "cell", "A").integers(1000)
    np.True_
    """
    digest = hashlib.sha256("\0".join(names).encode()).digest()
    return np.random.default_rng([seed, *np.frombuffer(digest, dtype="<u4").tolist()])


def _spectral_amplitude(shape: tuple[int, ...], length_px: float) -> Floats:
    """Return the square root of the torus covariance's eigenvalues, for a unit variance."""
    from scipy import fft

    rows, cols = (np.minimum(np.arange(n), n - np.arange(n)) for n in shape)
    covariance = np.exp(-np.hypot(rows[:, None], cols[None, :]) / length_px)
    eigenvalues = fft.fft2(covariance).real
    # The kink where the torus closes makes a few eigenvalues slightly negative.
    eigenvalues = np.maximum(eigenvalues, 0.0)
    eigenvalues /= eigenvalues.mean()
    return np.asarray(np.sqrt(eigenvalues[:, : shape[1] // 2 + 1]))


def _check(
    deviation_db: float, correlation_m: float, site_share: float = 0.0, seed: int = 0
) -> None:
    faults = Faults()
    values = ("deviation_db", deviation_db, "dB"), ("correlation_m", correlation_m, "metres")
    for name, value, unit in values:
        if not (np.isfinite(value) and value >= 0):
            faults.add(f"shadowing, {name}", f"{unit} ≥ 0", value)
    if not 0 <= site_share <= 1:
        faults.add("shadowing, site_share", "a fraction in 0..1", site_share, "per cent given")
    if seed < 0:
        faults.add("shadowing, seed", "a whole number ≥ 0", seed)
    faults.raise_if_any(InputError)
