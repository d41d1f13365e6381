"""The Bayes map filter: evidence, belief, alternative hypothesis, smoothing."""
