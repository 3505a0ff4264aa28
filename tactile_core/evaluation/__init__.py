"""Evaluation of accuracy against ground truth, and of run time and memory.

May import every room but cli and testing.
"""
