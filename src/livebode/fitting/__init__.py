"""From responses to what the machine is: physical parameters and rational models, with covariance."""
