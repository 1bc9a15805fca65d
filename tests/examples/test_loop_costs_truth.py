"""Every error in the description of a loop causes an error of the estimate."""

from examples.loop_costs import costs


def test_every_error_in_the_description_of_the_loop_biases_the_estimate() -> None:
    cost = costs()
    assert cost.pop("as it is") < 5e-6
    assert min(cost.values()) > 1e-4
    assert cost["one tick of delay too many"] > 0.05
