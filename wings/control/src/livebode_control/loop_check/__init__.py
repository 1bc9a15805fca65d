"""The described controllers compared with the recorded signals."""
