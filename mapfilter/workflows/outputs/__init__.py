"""What commands print and draw, and how they end."""
