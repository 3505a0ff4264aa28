"""Calibration of force: a model fitted to readings and to forces that a load cell measured."""
