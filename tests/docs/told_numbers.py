"""Numbers as pages write them, and the text of a page."""

from pathlib import Path

DOCS = Path(__file__).resolve().parents[2] / "docs"


def number(value: float) -> str:
    """Return a number as pages write it, with blanks between thousands."""
    return f"{value:,.10g}".replace(",", " ")


def share(value: float) -> str:
    """Return a share in per cent."""
    return f"{100 * value:.10g} %"


def e_to(log_odds: float) -> str:
    """Return odds as pages write them."""
    power = f"{log_odds:g}"
    return f":math:`e^{{{power}}}`" if len(power) > 1 else f":math:`e^{power}`"


def told(page: str) -> str:
    return " ".join((DOCS / f"{page}.rst").read_text(encoding="utf-8").split())
