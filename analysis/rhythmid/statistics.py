"""Quantiles that the whole package shares."""

# standard deviations on either side of the mean that contain 95 % of a normal distribution; half-width of every printed interval
NORMAL_95 = 1.959963984540054
