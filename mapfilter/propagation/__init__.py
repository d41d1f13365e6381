"""Path loss, line of sight, shadowing and the prediction of levels from a cell plan."""
