"""Which prediction a set of rasters plays reality to."""

from __future__ import annotations

from pathlib import Path

import rasterio

from mapfilter._io import sha256_file
from mapfilter.errors import InputError, fail
from mapfilter.workflows.sections import Config

_PREDICTION_TAG = "PREDICTION_SHA256"


def reality_tags(prediction: Path) -> dict[str, str]:
    """Return the tags of rasters that play reality to a prediction that is written already."""
    return {"PLAYS": "reality", _PREDICTION_TAG: sha256_file(prediction)}


def check_reality_there(config: Config) -> None:
    """See that there is reality to simulate in.

    Raises
    ------
    InputError
        It was not predicted yet.
    """
    if config.rasters.reality is None and not config.reality_path.exists():
        hint = (
            "not predicted yet; predict with prediction.reality.write = true, "
            'or set journeys.radio = "as_predicted"'
        )
        got = "no such file"
        raise fail(InputError, str(config.reality_path), "rasters that play reality", got, hint)


def check_reality(config: Config) -> None:
    """See that reality was played to the prediction that lies in the output folder now.

    Reality that is named in ``rasters.reality``, or that tells of no prediction, is taken as it is.

    Raises
    ------
    InputError
        It was played to another prediction, such as one with another plan.
    """
    prediction, reality = config.rasters_path, config.reality_path
    if config.rasters.reality is not None or not prediction.is_file():
        return
    with rasterio.open(reality) as source:
        played_to = source.tags().get(_PREDICTION_TAG)
    if played_to not in (None, sha256_file(prediction)):
        raise fail(
            InputError,
            str(reality),
            f"reality that was played to {prediction.name}, the prediction beside it",
            "that of another prediction",
            "predicted again without it; predict with prediction.reality.write = true, "
            "or name the file in rasters.reality",
        )
