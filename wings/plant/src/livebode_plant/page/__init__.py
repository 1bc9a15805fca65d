"""The page of a fleet in a browser (wings/plant/docs/fleet-page.md)."""
