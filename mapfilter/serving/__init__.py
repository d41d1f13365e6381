"""The live service: sessions of devices over HTTP, and positions of single reports."""
