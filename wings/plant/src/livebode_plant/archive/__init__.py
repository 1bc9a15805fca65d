"""Many recordings tracked once each, on the cores of a computer or a cluster, into one lake."""
