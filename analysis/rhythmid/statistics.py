"""Quantiles that the whole package shares."""

# standard deviations to either side of the mean that hold 95 % of a normal distribution; a half-width of every printed interval
NORMAL_95 = 1.959963984540054
