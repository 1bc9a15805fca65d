"""Many machines: recordings of an archive in a lake, trends over months, a live fleet, and their pages."""
