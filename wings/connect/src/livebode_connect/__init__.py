"""Results and events of livebode to other systems: the receivers of [[publish]]."""
