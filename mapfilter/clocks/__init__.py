"""Times as programs write them, in UTC seconds: of recordings and of drive tests."""
