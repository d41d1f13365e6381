"""Tables in files of other kinds (JSON, KML, workbooks, layers, logs of a phone), as CSV."""
