"""Pictures of the dashboard and of the report, each of a run of a simulated machine."""
