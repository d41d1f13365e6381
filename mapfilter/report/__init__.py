"""Pictures of maps, beliefs and errors; the only room that draws."""
