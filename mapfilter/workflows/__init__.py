"""One module per command: its configuration and the public function that runs it."""
