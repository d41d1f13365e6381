"""Many runs over a grid of settings: the plan, the runs, and one tidy table of results."""
