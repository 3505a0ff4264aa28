"""From frames to readings: the chain of estimators, the pipeline, and the sensor in front of it.

May import acquisition, conditioning, recordings and what these may import.
"""
