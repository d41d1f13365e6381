"""Plain CSV by its columns: names and units of headers, and each kind of field."""
