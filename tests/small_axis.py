"""The smallest axis.toml that tracks: three lines of the signals that `tests.command.signals` makes."""

SMALL_AXIS = """
[signals]
excitation = "w"
input = "u"
output = "y"
[lines]
frequencies = "50,100,200"
window = 100
[tracking]
hop = 20
"""
WITH_SCHEDULE = SMALL_AXIS.replace('output = "y"\n', 'output = "y"\nschedule = "n"\n')
