"""Tables of results as CSV and LaTeX."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from mapfilter._io import atomic_file
from mapfilter.errors import OutputError, fail


def write_table(table: pd.DataFrame, path: Path, *, digits: int | None = 4) -> Path:
    """Write a table as CSV or LaTeX, by the suffix of the path, in one step.

    The index is left out, the folder is made where it is missing, and the path is returned;
    ``digits`` are the significant digits of numbers, None for all of them.

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
