"""A live fleet: axes in partitions on a log (NATS JetStream), results exactly once (docs/fleet-design.md)."""
