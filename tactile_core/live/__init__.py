"""The live page: sensors in a browser, with buttons for the work of a day.

May import evaluation and what it may import.
"""
