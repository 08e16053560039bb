"""Starts the graph of an experiment: the command `rhythmid run`, its launch file, examples and layouts."""
