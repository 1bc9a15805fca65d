"""The page that shows a run while it goes, and one that was."""
