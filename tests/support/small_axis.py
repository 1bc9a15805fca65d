"""The smallest axis.toml: three lines of the signals of `tests.support.command.signals`; a line without excitation."""

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
ONE_LINE = """
[signals]
output = "y"
input = "w"
[lines]
frequencies = "100"
window = 400
"""
"""Without an excitation; valid with the direct estimator only."""
ONE_LINE_DIRECT = (
    ONE_LINE
    + """[tracking]
estimator = "direct"
"""
)
