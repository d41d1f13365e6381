"""The pass over hypotheses with levels only, or with absent cells only."""

import numpy as np

from mapfilter.models.ageing import as_it_is
from mapfilter.models.fingerprint import bound_table
from mapfilter.models.report_kernel import NOT_HEARD, NOT_SERVED, Heard, weigh_by_report

NOTHING = np.empty(0)


def weigh_by_levels(first, stop, ageing, pixel, predicted, terms, weight, log_weight):
    """Weigh hypotheses by levels, and age what they keep."""
    heard = *Heard(pixel, predicted, terms), *NOT_HEARD
    given = ageing, NOT_SERVED, *heard, bound_table(), weight, log_weight, NOTHING
    weigh_by_report(first, stop, *given)


def weigh_by_absence(first, stop, records, pixel, predicted, terms, table, weight, log_weight):
    """Weigh hypotheses by absent cells."""
    heard = *NOT_HEARD, *Heard(pixel, predicted, terms)
    given = as_it_is(records), NOT_SERVED, *heard, table, weight, log_weight, NOTHING
    weigh_by_report(first, stop, *given)
