"""Interactive views of located logs and databases: one HTML file each, without a server."""
