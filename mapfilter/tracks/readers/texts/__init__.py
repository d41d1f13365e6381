"""Files as text: unpacked, decoded, and divided into lines, columns and events."""
