"""Tables of results: as text, as CSV and as LaTeX."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any, Literal

import pandas as pd

from mapfilter._io import atomic_file
from mapfilter.errors import OutputError, fail

_MOST_CHARACTERS = 10_000


def write_table(table: pd.DataFrame, path: Path, *, digits: int | None = 4) -> Path:
    """Write a table as CSV or LaTeX, by the suffix of the path, in one step.

    Parameters
    ----------
    table : pandas.DataFrame
        The index is left out.
    path : Path
        Ends in ``.csv`` or ``.tex``; the folder is made where it is missing.
    digits : int, optional
        Significant digits of numbers; None for all of them.

    Returns
    -------
    Path
        ``path``.

    Raises
    ------
    OutputError
        The suffix is another one, or the file cannot be written.
    """
    if path.suffix not in (".csv", ".tex"):
        raise fail(OutputError, str(path), "a name that ends in .csv or .tex", path.name)
    shown = _rounded(table, digits)
    if path.suffix == ".csv":
        text = shown.to_csv(index=False, lineterminator="\n")
    else:
        text = latex_table(table, digits=digits)
    with atomic_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="")
    return path


def latex_table(table: pd.DataFrame, *, digits: int | None = 4) -> str:
    r"""Return a table in LaTeX, for the package ``booktabs``.

    Examples
    --------
    >>> print(latex_table(pd.DataFrame({"filter": ["ekf"], "error_m": [12.3456]})))
    \begin{tabular}{lr}
    \toprule
    filter & error\_m \\
    \midrule
    ekf & 12.35 \\
    \bottomrule
    \end{tabular}
    <BLANKLINE>
    """
    columns = "".join("r" if _is_numeric(table[name]) else "l" for name in table)
    shown = _rounded(table, digits)
    return str(shown.to_latex(index=False, escape=True, column_format=columns))


def text_table(table: pd.DataFrame, *, digits: int | None = 4) -> str:
    """Return a table as lines of text, columns of numbers to the right.

    Examples
    --------
    >>> rows = {"filter": ["ekf", "particle"], "error_m": [12.3456, 8.0]}
    >>> print(text_table(pd.DataFrame(rows)))
    filter    error_m
    ekf         12.35
    particle        8
    """
    from rich.console import Console
    from rich.table import Table

    drawn = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="")
    for name in table:
        side: Literal["left", "right"] = "right" if _is_numeric(table[name]) else "left"
        drawn.add_column(str(name), justify=side, no_wrap=True)
    for row in _rounded(table, digits).itertuples(index=False):
        drawn.add_row(*row)
    plain: dict[str, Any] = {"markup": False, "emoji": False, "highlight": False}
    console = Console(file=io.StringIO(), width=_MOST_CHARACTERS, color_system=None, **plain)
    with console.capture() as captured:
        console.print(drawn)
    return "\n".join(line.rstrip() for line in captured.get().splitlines())


def _rounded(table: pd.DataFrame, digits: int | None = 4) -> pd.DataFrame:
    """Return a table of texts: numbers to so many significant digits, None as nothing."""

    def text(value: Any) -> str:
        if value is None or value is pd.NA:
            return ""
        if isinstance(value, float) and digits is not None:
            return f"{value:.{digits}g}"
        return str(value)

    return pd.DataFrame({name: [text(value) for value in table[name]] for name in table})


def _is_numeric(column: pd.Series) -> bool:
    return all(value is None or isinstance(value, int | float) for value in column.tolist())
