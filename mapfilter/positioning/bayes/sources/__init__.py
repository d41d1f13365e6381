"""Sources of evidence: measurements of an epoch as log-likelihoods of hypotheses."""
