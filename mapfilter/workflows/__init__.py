"""Commands as functions: configurations and files in, files, figures and pictures out.

Every ``run_*`` function raises ``MapfilterError`` where an input is missing, wrong or does not fit
the others, and where the output cannot be written.
"""
