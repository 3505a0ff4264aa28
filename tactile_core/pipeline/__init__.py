"""Computes readings from frames: the chain of estimators, the pipeline, and the sensor.

May import acquisition, conditioning, recordings and what these may import.
"""
