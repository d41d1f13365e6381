"""How good an estimate is, against the truth: accuracy, success, and how sure one can be of it."""
