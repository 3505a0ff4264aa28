"""Pure functions on arrays, a folder or module for each word of the papers.

May import errors, and nothing else of ours.
"""
