"""The check-list of a release (CONTRIBUTING.md, "Making a release")."""
