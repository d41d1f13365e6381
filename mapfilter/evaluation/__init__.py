"""Evaluation against ground truth: accuracy, success, their intervals, calibration and bounds."""
