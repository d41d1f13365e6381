"""Where models meet filters: from an unknown start to a tracked position."""
